#include "render/accumulator.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace nacre::render {
namespace {

double LuminanceOf(double r, double g, double b) {
  return 0.2126 * r + 0.7152 * g + 0.0722 * b;
}

}  // namespace

Accumulator::Accumulator(const Film& film)
    : film_(film),
      sums_(static_cast<std::size_t>(film.crop_width) *
            static_cast<std::size_t>(film.crop_height)) {}

bool Accumulator::Add(std::size_t pixel,
                      Color radiance,
                      float alpha,
                      float filter_weight) {
  Sums& sums = sums_[pixel];
  const double w = static_cast<double>(filter_weight);
  const double r = w * static_cast<double>(radiance.x);
  const double g = w * static_cast<double>(radiance.y);
  const double b = w * static_cast<double>(radiance.z);
  if (!std::isfinite(r + g + b)) {
    ++sums.left_out;
    return false;
  }
  sums.r += r;
  sums.g += g;
  sums.b += b;
  sums.a += w * static_cast<double>(alpha);
  const double luminance = LuminanceOf(r, g, b);
  sums.squares += luminance * luminance;
  return true;
}

double Accumulator::RelativeError(int sample_count) const {
  double variances = 0;
  double squares = 0;
  for (const Sums& sums : sums_) {
    const double n = static_cast<double>(sample_count - sums.left_out);
    if (n < 2) {
      return std::numeric_limits<double>::infinity();
    }
    const double mean = LuminanceOf(sums.r, sums.g, sums.b) / n;
    variances += std::max(0.0, sums.squares / n - mean * mean) / (n - 1);
    squares += mean * mean;
  }
  return squares > 0 ? std::sqrt(variances / squares) : 0;
}

ExrPart Accumulator::ToImage(int sample_count) const {
  const bool luminance = film_.format == PixelFormat::kLuminance ||
                         film_.format == PixelFormat::kLuminanceAlpha;
  const bool alpha = film_.format == PixelFormat::kRgba ||
                     film_.format == PixelFormat::kLuminanceAlpha;
  ExrPart image;
  image.width = film_.crop_width;
  image.height = film_.crop_height;
  image.channels = luminance ? std::vector<std::string>{"Y"}
                             : std::vector<std::string>{"R", "G", "B"};
  if (alpha) {
    image.channels.push_back("A");
  }
  const std::size_t n = sums_.size();
  image.values.resize(image.channels.size() * n);
  for (std::size_t i = 0; i < n; ++i) {
    const Sums& sums = sums_[i];
    const double kept = static_cast<double>(sample_count - sums.left_out);
    const double scale = kept > 0 ? 1 / kept : 0;
    if (luminance) {
      image.values[i] = static_cast<float>(scale * LuminanceOf(sums.r, sums.g, sums.b));
    } else {
      image.values[i] = static_cast<float>(scale * sums.r);
      image.values[n + i] = static_cast<float>(scale * sums.g);
      image.values[2 * n + i] = static_cast<float>(scale * sums.b);
    }
    if (alpha) {
      image.values[(image.channels.size() - 1) * n + i] =
          static_cast<float>(scale * sums.a);
    }
  }
  return image;
}

}  // namespace nacre::render
