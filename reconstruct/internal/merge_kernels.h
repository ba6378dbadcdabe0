#pragma once

#include "reconstruct/internal/hdr_merge.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>

namespace nacre::reconstruct::internal {

/// One exposure of a bracket; brackets are given from the shortest to the longest.
struct Bracket {
  const std::uint16_t* counts;
  float exposure_us;
  float dark_counts;
  float shorter_us;  ///< sum of the shorter exposures
  float order;       ///< 0 for the shortest, 1 for the next, …
  float floor;       ///< variance without light, counts²
  float room;        ///< linear counts between dark and saturation

  /// What the shorter exposures saw is this many times as much here.
  float Ratio() const { return shorter_us > 0 ? exposure_us / shorter_us : 0; }
};

/// The noise model of the calibration: variance = signal · slope + floor; and the
/// response's curvature, linear = counts (1 + b1 counts + b2 counts²).
struct Noise {
  float slope;
  float saturation_counts;
  float b1;
  float b2;

  [[gnu::always_inline]] float Linear(float counts) const {
    return counts * (1.0F + counts * (b1 + counts * b2));
  }
  /// What the curvature makes of a variance, to first order.
  [[gnu::always_inline]] float Stretch(float counts) const {
    const float slope_there = 1.0F + counts * (2 * b1 + 3 * counts * b2);
    return slope_there * slope_there;
  }
};

/// A pixel that is expected this close to saturation is judged by its shorter
/// exposures: picking exposures by whether noise let them pass would lower the mean.
constexpr float kMarginSigmas = 4;

/// Merges any number of exposures of all pixels into `merged`, whose vectors have a
/// value a pixel; its saturated_count is set. Each step is a pass over a block of
/// pixels.
void MergeMany(std::span<const Bracket> brackets, Noise noise, RateFrame& merged);

/// The same, several times as fast, of at most kFewExposures: all steps of sixteen
/// pixels at a time stay in registers.
constexpr std::size_t kFewExposures = 4;
void MergeFew(std::span<const Bracket> brackets, Noise noise, RateFrame& merged);

}  // namespace nacre::reconstruct::internal
