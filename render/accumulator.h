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

  /// The relative L2 error of the luminance that independent samples would leave: the
  /// root of the pixels' summed variances over that of their summed squares. An upper
  /// bound in practice, since samples are spread better than independent ones. Infinite
  /// below two samples, 0 for a black picture.
  double RelativeError(int sample_count) const;

  /// The mean over `sample_count` samples a pixel, in the film's format.
  ExrPart ToImage(int sample_count) const;

 private:
  struct Sums {
    double r = 0;
    double g = 0;
    double b = 0;
    double a = 0;
    double squares = 0;  ///< of the luminance
    std::int64_t left_out = 0;
  };
  Film film_;
  std::vector<Sums> sums_;
};

}  // namespace nacre::render
