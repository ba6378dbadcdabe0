#pragma once

#include <filesystem>
#include <string>

namespace nacre::cli {

/// A file that comes with the command ("rigs/chessboard4x4.toml", "scenes/dragon.xml"):
/// in the folder NACRE_DATA if that is set, else in share/nacre beside the command (in
/// a build folder) or beside its bin (installed). Throws Error that lists where it
/// looked.
std::filesystem::path FindResource(const std::string& name);

}  // namespace nacre::cli
