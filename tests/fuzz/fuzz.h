#pragma once

#include <filesystem>

namespace nacre::fuzz {

/// What a target defines: the name its input is given (readers go by extensions), and
/// the reading. Errors that the reader throws are fine, anything else is a finding.
extern const char* const kFileName;
void Read(const std::filesystem::path& path);

}  // namespace nacre::fuzz
