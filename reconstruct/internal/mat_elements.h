#pragma once

#include <istream>
#include <string>

namespace nacre::reconstruct {

/// Looks through the elements of a MATLAB file of version 5 (from byte 128 to its end)
/// for lengths and counts that don't fit into what holds them: libmatio would take the
/// memory that they declare. Throws BadData naming `origin`.
void CheckMatElements(std::istream& file, bool big_endian, const std::string& origin);

}  // namespace nacre::reconstruct
