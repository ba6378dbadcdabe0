#pragma once

#include "core/json.h"

#include <filesystem>
#include <string>

namespace nacre {

/// Where an artefact came from; carried by every artefact we write.
struct Provenance {
  std::string command;            ///< the verb, e.g. "factor"
  Json options = Json::object();  ///< that it was made with
  Json inputs = Json::array();    ///< [{"file": name, "xxh3": hash}, …]

  /// Adds a file with its hash. Only its name is kept: artefacts travel between
  /// machines.
  void AddInput(const std::filesystem::path& path);

  /// With the software's version added. No time stamp: the same inputs, options and
  /// seed give the same bytes.
  std::string ToString() const;
};

}  // namespace nacre
