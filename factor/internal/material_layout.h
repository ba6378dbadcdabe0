#pragma once

/// *.nacre.exr: parts with the material's own channels, so that every EXR viewer shows
/// something sensible:
///   albedo     points_x × points_y                     first: what viewers open
///   row_scale  points_x × points_y                     missing: 1 everywhere
///   factors    (terms · map width) × map height        maps f_j side by side
///   kernels    (kernels · core) × (clusters · core)    kernels h_j, a cluster a row
///              (reciprocal: (core + 1) / 2 rows, the rest being their mirror image;
///              profiles: a pixel a kernel)
///   cluster    points_x × points_y, channel Y          missing: one cluster
/// Maps and kernels that all channels share are channel Y; those of one channel are a
/// part of its own, factors.R, kernels.R, …; a grey material's albedo and row_scale are
/// channel Y. Where the material has steps, values are whole numbers instead, times a
/// step. Everything else is in string attributes of the first part, prefixed "nacre.".
/// Up to version 5 there were always these five parts, of all channels.

#include "core/exr.h"
#include "factor/material.h"

#include <string>
#include <vector>

namespace nacre::factor::internal {

inline constexpr const char* kFormat = "material";
inline constexpr const char* kVersion = "6";
/// The same with a part for all channels and one checksum.
inline constexpr const char* kVersionOfOnePart = "5";
/// Without rest.
inline constexpr const char* kVersionWithoutRest = "4";
/// Without tucker and profiles.
inline constexpr const char* kVersionWithoutOrder = "3";
/// Without taps and the form they are of.
inline constexpr const char* kVersionWithoutTaps = "2";
/// Sums of floats: no form, margin or steps.
inline constexpr const char* kOldVersion = "1";

/// A sheet of pictures of equal size, `columns` side by side and `rows` below each
/// other, in channels. Its values run [channel][row][y][column][x], while the material
/// holds them [channel][row][column][y][x] (factor maps: one row of maps; kernels: one
/// row a cluster).
struct Sheet {
  int width = 0;
  int height = 0;
  int columns = 1;
  int rows = 1;
  std::size_t channels = 1;

  std::size_t Size() const {
    return channels * static_cast<std::size_t>(rows) *
           static_cast<std::size_t>(columns) * static_cast<std::size_t>(height) *
           static_cast<std::size_t>(width);
  }

  // Calls move(index in the sheet, index in the material).
  template <class Move>
  void ForEach(Move&& move) const {
    const auto w = static_cast<std::size_t>(width);
    const auto h = static_cast<std::size_t>(height);
    const auto n = static_cast<std::size_t>(columns);
    for (std::size_t r = 0; r < channels * static_cast<std::size_t>(rows); ++r) {
      for (std::size_t y = 0; y < h; ++y) {
        for (std::size_t column = 0; column < n; ++column) {
          for (std::size_t x = 0; x < w; ++x) {
            move(((r * h + y) * n + column) * w + x,
                 ((r * n + column) * h + y) * w + x);
          }
        }
      }
    }
  }
};

/// What a part of the file holds.
enum class PartKind { kAlbedo, kRowScale, kFactors, kKernels, kCluster };

struct PartPlan {
  PartKind kind{};
  std::string name;
  Sheet sheet;
  std::vector<std::string> channels;
  /// The channel that needs it; -1: all do.
  int channel = -1;
};

/// The parts that a file may have, in its order. `is_whole`: as up to version 5.
std::vector<PartPlan> PlanParts(const Material& m, bool is_whole);

/// Of all attributes that start with "nacre." but itself.
std::string AttributesChecksum(const ExrAttributes& attributes);

/// Of a part's values, in its order of channels.
std::string PartChecksum(const ExrPart& part);

/// Up to version 5: of all attributes and values, in the order of the file.
std::string WholeChecksum(const ExrAttributes& attributes,
                          const std::vector<ExrPart>& parts);

}  // namespace nacre::factor::internal
