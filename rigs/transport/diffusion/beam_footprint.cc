#include "rigs/transport/diffusion/beam_footprint.h"

#include "core/error.h"

#include <algorithm>
#include <cmath>

namespace nacre::rigs::diffusion {
namespace {

// Relative flux density at a point of the cross section.
double Density(const Beam& beam, double x_mm, double y_mm) {
  const double half = 0.5 * beam.width_mm;
  switch (beam.shape) {
    case BeamShape::kPencil:
      return 0;
    case BeamShape::kSquare:
      return std::max(std::abs(x_mm), std::abs(y_mm)) < half ? 1 : 0;
    case BeamShape::kDisc:
      return std::hypot(x_mm, y_mm) < half ? 1 : 0;
    case BeamShape::kGaussian:  // 1/e² at half its width
      return std::exp(-2 * (x_mm * x_mm + y_mm * y_mm) / (half * half));
  }
  throw LogicError("a beam of no shape");
}

}  // namespace

std::vector<BeamPoint> BeamFootprint(const Beam& beam, double step_mm) {
  std::vector<BeamPoint> points;
  if (beam.shape == BeamShape::kPencil) {
    const double aside_mm = 1e-6 * step_mm;
    for (const double sy : {-1.0, 1.0}) {
      for (const double sx : {-1.0, 1.0}) {
        points.push_back({{sx * aside_mm, sy * aside_mm}, 0.25, 0, 0});
      }
    }
    return points;
  }
  constexpr double kPointsAcross = 24;
  const double reach_mm =
      (beam.shape == BeamShape::kGaussian ? 1.25 : 0.5) * beam.width_mm;
  const int columns = static_cast<int>(std::ceil(reach_mm / step_mm - 0.5));
  const int fine = std::clamp(
      static_cast<int>(std::ceil(kPointsAcross * step_mm / beam.width_mm)), 1, 1000);
  double sum = 0;
  for (int j = -columns * fine; j < (columns + 1) * fine; ++j) {
    for (int i = -columns * fine; i < (columns + 1) * fine; ++i) {
      const double x = ((i + 0.5) / fine - 0.5) * step_mm;
      const double y = ((j + 0.5) / fine - 0.5) * step_mm;
      const double weight = Density(beam, x, y);
      if (weight > 0) {
        const auto column = [&](int k) {
          return static_cast<int>(std::floor(static_cast<double>(k) / fine));
        };
        points.push_back({{x, y}, weight, column(i), column(j)});
        sum += weight;
      }
    }
  }
  Expect(sum > 0, "a beam that covers a point");
  for (BeamPoint& point : points) {
    point.weight /= sum;
  }
  return points;
}

}  // namespace nacre::rigs::diffusion
