#include "rigs/phantom_stone.h"

#include "rigs/phantom_noise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace nacre::rigs {
namespace {

using Point = std::array<double, 3>;

constexpr double kStoneDegree = std::numbers::pi / 180;

double SmoothStep(double low, double high, double x) {
  const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

// A field whose zeros are the middles of veins, and how far they are from a point: to
// first order |f| / |∇f|.
class VeinField {
 public:
  VeinField(std::uint64_t seed, double warp)
      : base_(seed), warp_(seed + 1), warp_by_(warp) {}

  double DistanceFrom(const Point& p) const {
    constexpr double kStep = 1e-3;
    const double here = Value(p);
    double slope2 = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      Point beside = p;
      beside[axis] += kStep;
      const double slope = (Value(beside) - here) / kStep;
      slope2 += slope * slope;
    }
    // Where the field is flat, the zero is not the nearest of anything: far away.
    constexpr double kFlat = 0.05;
    return std::abs(here) / std::sqrt(slope2 + kFlat);
  }

 private:
  double Value(const Point& p) const {
    const auto [x, y, z] = p;
    const double dx = warp_by_ * warp_.Turbulent(0.7 * x, 0.7 * y, 0.7 * z, 3);
    const double dy = warp_by_ * warp_.Turbulent(0.7 * x + 31.7, 0.7 * y, 0.7 * z, 3);
    const double dz = warp_by_ * warp_.Turbulent(0.7 * x, 0.7 * y + 47.3, 0.7 * z, 3);
    return base_.At(x + dx, y + dy, z + dz);
  }

  GradientNoise base_;
  GradientNoise warp_;
  double warp_by_;
};

// Colour across a vein: half at half the width from the middle.
double Profile(double distance, double width) {
  const double t = 2 * distance / width;
  return std::exp2(-t * t);
}

}  // namespace

VoxelFunction MarbleMixture(const VeinOptions& options) {
  const auto seed = static_cast<std::uint64_t>(options.seed) * 16;
  const double c = std::cos(options.direction_deg * kStoneDegree);
  const double s = std::sin(options.direction_deg * kStoneDegree);
  return [o = options,
          c,
          s,
          large = VeinField(seed, options.warp),
          small = VeinField(seed + 4, 0.6 * options.warp),
          cloud = GradientNoise(seed + 8)](double x_mm, double y_mm, double depth_mm) {
    // In scales, along and across the veins' direction.
    const Point p{(c * x_mm + s * y_mm) / (o.scale_mm * o.stretch),
                  (c * y_mm - s * x_mm) / o.scale_mm,
                  depth_mm / (o.scale_mm * o.stretch)};
    const double width = o.width_mm / o.scale_mm;
    // Veins swell and pinch out.
    const double swell =
        SmoothStep(-0.55, 0.5, cloud.Turbulent(1.3 * p[0], 1.3 * p[1], 1.3 * p[2], 2));
    const double distance = large.DistanceFrom(p);
    const double vein =
        Profile(distance, width * (0.35 + 1.3 * swell)) * (0.45 + 0.55 * swell);
    const double stain =
        0.3 * swell * std::exp(-distance / (5 * width)) *
        SmoothStep(-0.4, 0.6, cloud.Turbulent(5 * p[0], 5 * p[1] + 9, 5 * p[2], 4));
    constexpr double kFiner = 2.7;
    const Point q{kFiner * p[1] + 5.3, kFiner * p[0] * 0.6 - 2.1, kFiner * p[2]};
    const double present =
        SmoothStep(-0.05, 0.45, cloud.At(1.7 * p[0] + 40, 1.7 * p[1] + 40, 1.7 * p[2]));
    const double fine =
        o.fine * present * Profile(small.DistanceFrom(q) / kFiner, 0.45 * width);
    const double mist =
        o.cloud *
        SmoothStep(-0.5, 0.9, cloud.Turbulent(2 * p[0], 2 * p[1] + 70, 2 * p[2], 5));
    // What absorbs adds up, and no more than all of it is vein.
    return 1 - (1 - vein) * (1 - stain) * (1 - fine) * (1 - mist);
  };
}

VoxelFunction OnyxMixture(const OnyxOptions& options) {
  const auto seed = static_cast<std::uint64_t>(options.seed) * 16 + 11;
  const double dip = options.dip_deg * kStoneDegree;
  const Point ahead{std::cos(options.direction_deg * kStoneDegree) * std::cos(dip),
                    std::sin(options.direction_deg * kStoneDegree) * std::cos(dip),
                    std::sin(dip)};
  return [o = options,
          ahead,
          front = GradientNoise(seed),
          bands = GradientNoise(seed + 1)](double x_mm, double y_mm, double depth_mm) {
    const double x = x_mm / o.scale_mm;
    const double y = y_mm / o.scale_mm;
    const double z = depth_mm / o.scale_mm;
    // When the front passed here, in bands: the bumps of the rock it grew on, and a
    // little roughness of its own.
    const double when =
        (ahead[0] * x_mm + ahead[1] * y_mm + ahead[2] * depth_mm) / o.band_mm +
        2 * o.warp * front.Turbulent(x, y, z, 2) +
        0.12 * front.Turbulent(7 * x, 7 * y, 7 * z, 4);
    // Noise along time alone: broad bands, narrower ones in them, hairlines.
    const double broad =
        bands.At(0.37 * when, 0.5, 0.5) + 0.6 * bands.At(0.81 * when, 9.5, 0.5);
    const double thin = bands.At(2.3 * when, 21.5, 0.5);
    const double colour = 0.5 + 0.85 * broad + 0.18 * thin;
    // Sharp edges: colours gather around a few values.
    constexpr double kSteps = 4;
    const double step = std::floor(colour * kSteps);
    const double stepped =
        (step + SmoothStep(0.35, 0.65, colour * kSteps - step)) / kSteps;
    const double speckle = 0.04 * front.Turbulent(15 * x, 15 * y, 15 * z, 3);
    return std::clamp(std::lerp(colour, stepped, o.sharpness) + speckle, 0.0, 1.0);
  };
}

}  // namespace nacre::rigs
