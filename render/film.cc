#include "render/film.h"

#include "core/error.h"
#include "render/warp.h"

#include <algorithm>
#include <cmath>

namespace nacre::render {
namespace {

// [Mitchell & Netravali 88]
double Mitchell(double x, double b, double c) {
  const double x2 = x * x;
  const double x3 = x2 * x;
  if (x < 1) {
    return ((12 - 9 * b - 6 * c) * x3 + (-18 + 12 * b + 6 * c) * x2 + (6 - 2 * b)) / 6;
  }
  if (x < 2) {
    return ((-b - 6 * c) * x3 + (6 * b + 30 * c) * x2 + (-12 * b - 48 * c) * x +
            (8 * b + 24 * c)) /
           6;
  }
  return 0;
}

double Sinc(double x) {
  const double t = std::numbers::pi * x;
  return t < 1e-6 ? 1 : std::sin(t) / t;
}

// f at distance x ≥ 0 in pixels.
double FilterValue(const Film& film, double x) {
  const double radius = static_cast<double>(film.filter_radius);
  if (x > radius) {
    return 0;
  }
  switch (film.filter) {
    case FilterKind::kBox:
      return 1;
    case FilterKind::kTent:
      return std::max(0.0, 1 - x / radius);
    case FilterKind::kGaussian: {
      // Lowered so that it ends at 0.
      const double s = static_cast<double>(film.gaussian_stddev);
      const double a = -0.5 / (s * s);
      return std::max(0.0, std::exp(a * x * x) - std::exp(a * radius * radius));
    }
    case FilterKind::kMitchell:
      return Mitchell(2 * x / radius,
                      static_cast<double>(film.mitchell_b),
                      static_cast<double>(film.mitchell_c));
    case FilterKind::kCatmullRom:
      return Mitchell(2 * x / radius, 0, 0.5);
    case FilterKind::kLanczos:
      return Sinc(x) * Sinc(x / radius);
  }
  throw LogicError("unknown filter");
}

}  // namespace

float DefaultRadius(FilterKind kind) {
  switch (kind) {
    case FilterKind::kBox:
      return 0.5F;
    case FilterKind::kTent:
      return 1;
    case FilterKind::kGaussian:
    case FilterKind::kMitchell:
    case FilterKind::kCatmullRom:
      return 2;
    case FilterKind::kLanczos:
      return 3;
  }
  throw LogicError("unknown filter");
}

FilterSampler::FilterSampler(const Film& film) : radius_(film.filter_radius) {
  constexpr std::size_t kCells = 512;
  cumulative_.reserve(kCells);
  sign_.reserve(kCells);
  double sum = 0;
  double signed_sum = 0;
  std::vector<double> cumulative;
  for (std::size_t i = 0; i < kCells; ++i) {
    const double x = (2 * (static_cast<double>(i) + 0.5) / kCells - 1) *
                     static_cast<double>(radius_);
    const double f = FilterValue(film, std::abs(x));
    sum += std::abs(f);
    signed_sum += f;
    cumulative.push_back(sum);
    sign_.push_back(f < 0 ? -1.0F : 1.0F);
  }
  for (const double c : cumulative) {
    cumulative_.push_back(static_cast<float>(c / sum));
  }
  cumulative_.back() = 1;
  std::size_t cell = 0;
  for (std::size_t i = 0; i < kCells; ++i) {
    while (cumulative_[cell] <= static_cast<float>(i) / kCells) {
      ++cell;
    }
    guide_.push_back(cell);
  }
  scale_ = static_cast<float>(sum / signed_sum);
}

FilterSampler::Axis FilterSampler::SampleAxis(float u) const {
  const float cells = static_cast<float>(cumulative_.size());
  std::size_t i = guide_[static_cast<std::size_t>(u * cells)];
  while (cumulative_[i] <= u) {
    ++i;
  }
  const float low = i > 0 ? cumulative_[i - 1] : 0.0F;
  const float inside = (u - low) / (cumulative_[i] - low);
  const float x = (static_cast<float>(i) + inside) / cells;
  return {(2 * x - 1) * radius_, sign_[i]};
}

FilterSampler::Sample FilterSampler::operator()(Vec2 u) const {
  const Axis x = SampleAxis(u.x);
  const Axis y = SampleAxis(u.y);
  return {{x.offset, y.offset}, x.sign * y.sign * scale_ * scale_};
}

}  // namespace nacre::render
