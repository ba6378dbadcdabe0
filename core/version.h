#pragma once

#include <string>

namespace nacre {

/// The software's version, e.g. "0.1.0".
std::string Version();

/// One line a library that this build uses, "name version".
std::string LibraryVersions();

}  // namespace nacre
