#include "factor/internal/form_weights.h"

#include "factor/internal/profiles.h"
#include "factor/internal/tucker.h"

#include <algorithm>
#include <cmath>

namespace nacre::factor::internal {
namespace {

constexpr std::int64_t kPoints = 256;

// Calls use(point, intensities, slopes): of each cell, Σ_c (dR_c/dI)².
template <class Use>
void ForSomePoints(const Material& m, Use&& use) {
  const auto window = static_cast<std::size_t>(m.WindowSize());
  std::vector<double> intensity(window);
  std::vector<double> slope2(window);
  const std::int64_t step = std::max<std::int64_t>(1, m.PointCount() / kPoints);
  for (std::int64_t point = 0; point < m.PointCount(); point += step) {
    TuckerIntensity(
        m,
        {static_cast<int>(point % m.points_x), static_cast<int>(point / m.points_x)},
        intensity.data());
    for (std::size_t cell = 0; cell < window; ++cell) {
      slope2[cell] = 0;
      for (int c = 0; c < static_cast<int>(m.channels.size()); ++c) {
        double slope = 0;
        for (int power = m.order; power > 0; --power) {
          const float* map = m.FactorMap(0, TuckerCoefficientMap(m, c, power));
          slope = slope * intensity[cell] + power * static_cast<double>(map[point]);
        }
        slope2[cell] += slope * slope;
      }
    }
    use(point, intensity, slope2);
  }
}

}  // namespace

std::vector<double> TuckerMapWeights(const Material& m) {
  std::vector<double> squares(static_cast<std::size_t>(m.MapCount()), 0.0);
  const int channels = static_cast<int>(m.channels.size());
  int used = 0;
  ForSomePoints(m, [&](std::int64_t point, const auto& intensity, const auto& slope2) {
    ++used;
    const std::int64_t shift = TuckerShift(m, point);
    for (std::size_t cell = 0; cell < intensity.size(); ++cell) {
      const std::int64_t place =
          ShiftedCell(m.core, shift, static_cast<std::int64_t>(cell));
      for (int t = 0; t < m.terms; ++t) {
        const auto h = static_cast<double>(m.Kernel(0, 0, t)[place]);
        squares[static_cast<std::size_t>(t)] += slope2[cell] * h * h;
      }
      double power2 = 1;
      for (int power = 0; power <= m.order; ++power) {
        for (int c = 0; c < channels; ++c) {
          squares[static_cast<std::size_t>(TuckerCoefficientMap(m, c, power))] +=
              power2;
        }
        power2 *= intensity[cell] * intensity[cell];
      }
    }
  });
  for (double& square : squares) {
    square = std::sqrt(square / used);
  }
  return squares;
}

double TuckerGain(const Material& m) {
  double sum = 0;
  double count = 0;
  ForSomePoints(m, [&](std::int64_t, const auto&, const auto& slope2) {
    for (const double slope : slope2) {
      sum += slope;
      count += 1;
    }
  });
  // Where nothing depends on the kernels, their steps are those of numbers near 1.
  return sum > 0 ? std::sqrt(sum / count) : 1;
}

std::vector<double> ProfilesMapWeights(const Material& m) {
  std::vector<double> weights;
  const int radius = (m.core - 1) / 2;
  for (int c = 0; c < static_cast<int>(m.channels.size()); ++c) {
    for (const Gaussian& gaussian : GaussiansOf(m, c)) {
      double sum = 0;
      for (int v = -radius; v <= radius; ++v) {
        for (int u = -radius; u <= radius; ++u) {
          sum += std::pow(gaussian.At(u, v), 2);
        }
      }
      weights.push_back(std::sqrt(sum));
    }
  }
  return weights;
}

}  // namespace nacre::factor::internal
