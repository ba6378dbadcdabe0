#pragma once

#include "core/exr.h"
#include "render/film.h"

#include <cstdint>
#include <vector>

namespace nacre::render {

/// Sums of samples, a pixel of the crop window.
class Accumulator {
 public:
  explicit Accumulator(const Film& film);

  /// Samples that aren't finite are left out; false for those.
  bool Add(std::size_t pixel, Color radiance, float alpha, float filter_weight);

  /// The mean over `sample_count` samples a pixel, in the film's format.
  ExrPart ToImage(int sample_count) const;

 private:
  struct Sums {
    double r = 0;
    double g = 0;
    double b = 0;
    double a = 0;
    std::int64_t left_out = 0;
  };
  Film film_;
  std::vector<Sums> sums_;
};

}  // namespace nacre::render
