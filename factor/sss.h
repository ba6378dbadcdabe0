#pragma once

#include "core/options.h"
#include "core/progress.h"
#include "factor/material.h"

#include <cstdint>
#include <filesystem>

namespace nacre::factor {

/// What a profile file doesn't say about itself.
struct SssOptions {
  double pitch_mm = 0;  ///< has no default: units aren't guessed
  double eta = 1;
  double scale = 1;  ///< multiplies all weights
};

/// Gaussian profiles as SubEdit and LinSSS keep them, `.sss` (layout:
/// factor/README.md), to a material of form kProfiles: weights as they are, β from
/// pixel⁻² to mm⁻². Throws BadData if sizes make no sense or don't match the length of
/// the file (both are named), for a weight that is negative or not finite, and for a β
/// that isn't positive (record and byte are named); UsageError for options.
Material ReadSss(const std::filesystem::path& path, const SssOptions& options);

/// Writes a kProfiles material of three channels. Pitch, index and what lies beyond the
/// grid have no place there. Returns the size of the file. Throws UsageError for
/// another material.
std::int64_t WriteSss(const std::filesystem::path& path, const Material& material);

/// The slices of a material, `*.rd.exr`; cells whose x_o lies beyond the grid are
/// marked invalid. Returns how many.
std::int64_t WriteSlices(const std::filesystem::path& path,
                         const Material& material,
                         const ProgressFunction& progress = {});

}  // namespace nacre::factor
