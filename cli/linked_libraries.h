#pragma once

#include <string>

namespace nacre::cli {

/// What this process is made of besides our code, a line each: the libraries that are
/// compiled in, with versions, then the shared ones that were loaded and from where.
std::string LinkedLibraries();

}  // namespace nacre::cli
