#pragma once

namespace nacre::cli::view {

/// The whole page: markup, style and script; asks for state.json and the rest beside
/// it.
extern const char* const kPage;

}  // namespace nacre::cli::view
