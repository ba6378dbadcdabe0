#include "factor/internal/reciprocal_taps.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

namespace nacre::factor::internal {

std::vector<TapPoint> TapPoints(int du, int dv, int taps) {
  std::map<std::tuple<int, int, int>, double> weights;  // by tap, row, column
  for (int tap = 1; tap < taps; ++tap) {
    const int parts = 1 << tap;
    for (int part = 1; part < parts; part += 2) {
      const double x = static_cast<double>(du) * part / parts;
      const double y = static_cast<double>(dv) * part / parts;
      const double left = std::floor(x);
      const double top = std::floor(y);
      const double share = 4.0 / parts;
      for (int b = 0; b < 2; ++b) {
        for (int a = 0; a < 2; ++a) {
          const double across = a == 1 ? x - left : 1 - (x - left);
          const double down = b == 1 ? y - top : 1 - (y - top);
          weights[{tap, static_cast<int>(top) + b, static_cast<int>(left) + a}] +=
              share * across * down;
        }
      }
    }
  }
  std::vector<TapPoint> points;
  for (const auto& [at, weight] : weights) {
    if (weight > 0) {
      points.push_back({std::get<0>(at),
                        std::get<2>(at),
                        std::get<1>(at),
                        static_cast<float>(weight)});
    }
  }
  return points;
}

}  // namespace nacre::factor::internal
