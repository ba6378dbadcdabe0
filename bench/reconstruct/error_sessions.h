#pragma once

#include "acquire/session.h"
#include "core/options.h"

#include <filesystem>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace nacre::bench {

/// What is captured: one of the bench's phantoms, on a rig described by a file.
struct ErrorSession {
  std::filesystem::path rig;
  std::filesystem::path folder;  ///< sessions that are complete there are taken
  std::string phantom;           ///< one of ErrorPhantoms()
  std::string seed = "4711";
  /// Keys of the rig file and what they are to be instead.
  std::vector<std::pair<std::string, std::string>> changes = {};
};

/// chessboard, marble (veined), skin (nearly homogeneous).
std::vector<std::string> ErrorPhantoms();

/// A folder with phantom.toml, rig.toml and the complete session. Throws BadData if a
/// key isn't in the rig file.
std::filesystem::path CaptureErrorSession(const ErrorSession& session);

/// Where on the sample's surface the twin's beams arrived, grid point by grid point: of
/// a beam that isn't round more than one place, equally bright.
std::vector<std::vector<PointMm>> PointsLit(const std::filesystem::path& folder,
                                            const acquire::SessionReader& session);

}  // namespace nacre::bench
