#include "cli/report/color_map.h"

#include "core/png.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace nacre::cli::report {
namespace {

struct Lab {
  double l, a, b;
};

// To linear sRGB [Ottosson20, Oklab].
Rgb8 FromOklab(Lab c) {
  const double l = std::pow(c.l + 0.3963377774 * c.a + 0.2158037573 * c.b, 3);
  const double m = std::pow(c.l - 0.1055613458 * c.a - 0.0638541728 * c.b, 3);
  const double s = std::pow(c.l - 0.0894841775 * c.a - 1.2914855480 * c.b, 3);
  const auto encode = [](double linear) {
    return SrgbFromLinear(static_cast<float>(std::clamp(linear, 0.0, 1.0)));
  };
  return {encode(4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s),
          encode(-1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s),
          encode(-0.0041960863 * l - 0.7034186147 * m + 1.7076147010 * s)};
}

// Evenly spaced stops in Oklab, where straight lines keep lightness even.
Rgb8 Interpolate(std::span<const Lab> stops, double t) {
  const double place =
      (t > 0 ? std::min(t, 1.0) : 0.0) * static_cast<double>(stops.size() - 1);
  const auto at = std::min(static_cast<std::size_t>(place), stops.size() - 2);
  const double w = place - static_cast<double>(at);
  const Lab& x = stops[at];
  const Lab& y = stops[at + 1];
  return FromOklab(
      {x.l + w * (y.l - x.l), x.a + w * (y.a - x.a), x.b + w * (y.b - x.b)});
}

}  // namespace

Rgb8 SequentialColor(double t) {
  constexpr std::array<Lab, 6> kStops{{{0.12, 0.01, -0.035},
                                       {0.30, 0.045, -0.115},
                                       {0.47, 0.135, -0.055},
                                       {0.64, 0.145, 0.080},
                                       {0.82, 0.050, 0.135},
                                       {0.98, 0.000, 0.050}}};
  return Interpolate(kStops, t);
}

Rgb8 DivergingColor(double t) {
  constexpr std::array<Lab, 5> kStops{{{0.38, -0.025, -0.120},
                                       {0.66, -0.035, -0.085},
                                       {0.96, 0.000, 0.006},
                                       {0.66, 0.110, 0.065},
                                       {0.42, 0.145, 0.075}}};
  return Interpolate(kStops, 0.5 + 0.5 * t);
}

}  // namespace nacre::cli::report
