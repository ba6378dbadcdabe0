#include "render/accumulator.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace nacre::render {
namespace {

double Weighed(double r, double g, double b) {
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
  const double luminance = Weighed(r, g, b);
  ++sums.samples;
  sums.squares += luminance * luminance;
  return true;
}

Accumulator::Luminance Accumulator::LuminanceOf(std::size_t pixel) const {
  const Sums& sums = sums_[pixel];
  const auto n = static_cast<double>(sums.samples);
  Luminance luminance{0, std::numeric_limits<double>::infinity(), sums.samples};
  if (n > 0) {
    luminance.mean = Weighed(sums.r, sums.g, sums.b) / n;
  }
  if (n > 1) {
    const double spread = sums.squares / n - luminance.mean * luminance.mean;
    luminance.variance = std::max(0.0, spread) * n / (n - 1);
  }
  return luminance;
}

std::int64_t Accumulator::SamplesMade() const {
  std::int64_t sum = 0;
  for (std::size_t pixel = 0; pixel < sums_.size(); ++pixel) {
    sum += SamplesMade(pixel);
  }
  return sum;
}

double Accumulator::RelativeError() const {
  double variances = 0;
  double squares = 0;
  for (std::size_t i = 0; i < sums_.size(); ++i) {
    const Luminance pixel = LuminanceOf(i);
    if (pixel.samples < 2) {
      return std::numeric_limits<double>::infinity();
    }
    variances += pixel.variance / static_cast<double>(pixel.samples);
    squares += pixel.mean * pixel.mean;
  }
  return squares > 0 ? std::sqrt(variances / squares) : 0;
}

ExrPart Accumulator::ToImage() const {
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
    const double scale = sums.samples > 0 ? 1 / static_cast<double>(sums.samples) : 0;
    if (luminance) {
      image.values[i] = static_cast<float>(scale * Weighed(sums.r, sums.g, sums.b));
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

std::vector<ExrPart> Accumulator::ToAovs() const {
  const auto part = [&](const char* name, const char* channel) {
    ExrPart made;
    made.name = name;
    made.width = film_.crop_width;
    made.height = film_.crop_height;
    made.channels = {channel};
    made.values.resize(sums_.size());
    return made;
  };
  ExrPart variance = part("variance", "Y");
  ExrPart samples = part("samples", "N");
  for (std::size_t i = 0; i < sums_.size(); ++i) {
    const Luminance pixel = LuminanceOf(i);
    const auto n = static_cast<double>(pixel.samples);
    variance.values[i] = n > 1 ? static_cast<float>(pixel.variance / n) : 0.0F;
    samples.values[i] = static_cast<float>(n);
  }
  return {std::move(variance), std::move(samples)};
}

std::string Accumulator::Bytes() const {
  return {reinterpret_cast<const char*>(sums_.data()), sums_.size() * sizeof(Sums)};
}

bool Accumulator::Restore(std::string_view bytes) {
  if (bytes.size() != sums_.size() * sizeof(Sums)) {
    return false;
  }
  std::memcpy(sums_.data(), bytes.data(), bytes.size());
  return true;
}

std::string Accumulator::Bytes(const PixelBlock& block) const {
  std::string bytes;
  for (int y = block.y0; y < block.y1; ++y) {
    bytes.append(reinterpret_cast<const char*>(&sums_[RowStart(block, y)]),
                 BytesInRow(block));
  }
  return bytes;
}

bool Accumulator::Restore(const PixelBlock& block, std::string_view bytes) {
  const std::size_t row = BytesInRow(block);
  if (bytes.size() != static_cast<std::size_t>(block.y1 - block.y0) * row) {
    return false;
  }
  for (int y = block.y0; y < block.y1; ++y) {
    std::memcpy(&sums_[RowStart(block, y)], bytes.data(), row);
    bytes.remove_prefix(row);
  }
  return true;
}

}  // namespace nacre::render
