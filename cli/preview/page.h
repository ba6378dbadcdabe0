#pragma once

namespace nacre::cli::preview {

/// The whole page: markup, style and script; asks for state.json and frame.png beside
/// it.
extern const char* const kPage;

}  // namespace nacre::cli::preview
