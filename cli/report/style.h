#pragma once

namespace nacre::cli::report {

/// The CSS of every page: light and dark, for screen and paper.
const char* StyleSheet();

}  // namespace nacre::cli::report
