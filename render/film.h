#pragma once

#include "render/vec.h"

#include <string>
#include <vector>

namespace nacre::render {

enum class FilterKind { kBox, kTent, kGaussian, kMitchell, kCatmullRom, kLanczos };
enum class PixelFormat { kRgb, kRgba, kLuminance, kLuminanceAlpha };

struct Film {
  int width = 768;
  int height = 576;
  int crop_x = 0;
  int crop_y = 0;
  int crop_width = 768;
  int crop_height = 576;
  PixelFormat format = PixelFormat::kRgb;
  FilterKind filter = FilterKind::kGaussian;
  float filter_radius = 2;       ///< pixels; Lanczos: lobes
  float gaussian_stddev = 0.5F;  ///< pixels
  float mitchell_b = 1.0F / 3;
  float mitchell_c = 1.0F / 3;
};

/// The radius that a filter has unless told.
float DefaultRadius(FilterKind kind);

/// Offsets from a pixel's centre with density |f| / ∫|f|, f the film's separable filter
/// [Ernst06]. The mean of radiance · weight over samples is the filtered pixel, with no
/// splatting into neighbours. Where f ≥ 0, the weight is 1; where it is negative, −1,
/// scaled.
class FilterSampler {
 public:
  explicit FilterSampler(const Film& film);
  struct Sample {
    Vec2 offset;
    float weight;
  };
  Sample operator()(Vec2 u) const;

  float radius() const { return radius_; }

 private:
  struct Axis {
    float offset;
    float sign;
  };
  Axis SampleAxis(float u) const;

  float radius_ = 0;
  float scale_ = 1;                 ///< ∫|f| / ∫f
  std::vector<float> cumulative_;   ///< of |f| over the cells of [−radius, radius]
  std::vector<std::size_t> guide_;  ///< first cell that ends above i / size
  std::vector<float> sign_;
};

}  // namespace nacre::render
