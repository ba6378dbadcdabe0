#pragma once

#include "core/exr.h"
#include "factor/material.h"

#include <map>
#include <string>

namespace nacre::factor::internal {

/// What the attributes of a material's file say.
struct MaterialHeader {
  Material material;   ///< without maps, kernels, clusters, scales and albedo
  double f_least = 0;  ///< of codes, where there are steps
  double h_least = 0;
  bool is_whole = false;  ///< one checksum of all, a part for all channels: version ≤ 5
  std::map<std::string, std::string> parts;  ///< their checksums (version 6 on)
  std::string checksum;
};

/// Throws BadData naming `path` and the attribute that makes no sense, also for a file
/// of another kind or a newer version.
MaterialHeader ReadMaterialHeader(const ExrAttributes& attributes,
                                  const std::string& path);

}  // namespace nacre::factor::internal
