#pragma once

#include "core/exr.h"
#include "render/film.h"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace nacre::render {

/// Pixels of a crop window, up to before (x1, y1).
struct PixelBlock {
  int x0 = 0;
  int y0 = 0;
  int x1 = 0;
  int y1 = 0;
};

/// Sums of samples, a pixel of the crop window. Pixels may have different numbers of
/// them.
class Accumulator {
 public:
  explicit Accumulator(const Film& film);

  /// Samples that aren't finite are left out; false for those.
  bool Add(std::size_t pixel, Color radiance, float alpha, float filter_weight);

  /// Of one pixel's luminance, in figures of independent samples: an upper bound in
  /// practice, since samples are spread better than those.
  struct Luminance {
    double mean = 0;
    double variance = 0;  ///< of a sample; infinite below two samples
    std::int64_t samples = 0;
  };
  Luminance LuminanceOf(std::size_t pixel) const;
  /// With those that were left out.
  std::int64_t SamplesMade(std::size_t pixel) const {
    return sums_[pixel].samples + sums_[pixel].left_out;
  }

  std::int64_t SamplesMade() const;  ///< of all pixels together

  /// The relative L2 error of the luminance: the root of the variances of the pixels'
  /// means, summed, over that of their summed squares. Infinite while a pixel has less
  /// than two samples, 0 for a black picture.
  double RelativeError() const;

  /// The means, in the film's format.
  ExrPart ToImage() const;
  /// The variance of each pixel's mean luminance (part "variance", channel Y), and how
  /// many samples it has (part "samples", channel N).
  std::vector<ExrPart> ToAovs() const;

  std::size_t PixelCount() const { return sums_.size(); }

  /// All sums as bytes, of this machine's kind, and back. False if `bytes` are of
  /// another size of film.
  std::string Bytes() const;
  bool Restore(std::string_view bytes);
  /// The same of some of its pixels.
  std::string Bytes(const PixelBlock& block) const;
  bool Restore(const PixelBlock& block, std::string_view bytes);

 private:
  struct Sums {
    double r = 0;
    double g = 0;
    double b = 0;
    double a = 0;
    double squares = 0;  ///< of the luminance
    std::int64_t samples = 0;
    std::int64_t left_out = 0;
  };
  std::size_t RowStart(const PixelBlock& block, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(film_.crop_width) +
           static_cast<std::size_t>(block.x0);
  }
  static std::size_t BytesInRow(const PixelBlock& block) {
    return static_cast<std::size_t>(block.x1 - block.x0) * sizeof(Sums);
  }

  Film film_;
  std::vector<Sums> sums_;
};

}  // namespace nacre::render
