#include "calibrate/internal/light_noise.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace nacre::calibrate::internal {
namespace {

double Mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) /
         static_cast<double>(values.size());
}

// The variance of spots' powers from picture to picture, relative; what all have in
// common taken off. Pictures that visit the lattice the same way round are compared:
// the others' spots lie elsewhere by the mirrors' hysteresis, and their speckle
// differs. Returns the sum over pictures and spots, and how many of them are free.
struct Scatter {
  double variance = 0;
  double freedom = 0;
};

Scatter RelativeScatter(const SpotPowers& powers, std::size_t ways) {
  Scatter scatter;
  double square = 0;
  for (std::size_t way = 0; way < ways; ++way) {
    std::vector<double> mean;
    double n = 0;
    for (std::size_t k = way; k < powers.pictures.size(); k += ways) {
      mean.resize(powers.pictures[k].size(), 0.0);
      for (std::size_t s = 0; s < mean.size(); ++s) {
        mean[s] += powers.pictures[k][s];
      }
      n += 1;
    }
    if (n < 2) {
      continue;
    }
    for (std::size_t k = way; k < powers.pictures.size(); k += ways) {
      const double all = Mean(powers.pictures[k]) / Mean(mean);
      for (std::size_t s = 0; s < mean.size(); ++s) {
        const double deviation = powers.pictures[k][s] / (all * mean[s]) - 1;
        square += deviation * deviation;
      }
    }
    scatter.freedom += (n - 1) * static_cast<double>(mean.size());
  }
  scatter.variance = scatter.freedom > 0 ? square / scatter.freedom : 0;
  return scatter;
}

}  // namespace

void LightNoiseSums::Add(const SpotPowers& powers, std::size_t ways) {
  const auto frames = static_cast<double>(powers.pictures.size());
  const Scatter scatter = RelativeScatter(powers, ways);
  double ripple2 = 0;
  if (scatter.freedom > 0) {
    ripple2 = scatter.variance - powers.noise;
    ripple2_ += ripple2;
    ripple2_variance_ += 2 * scatter.variance * scatter.variance / scatter.freedom;
  }
  const double lasting = powers.spread * powers.spread - powers.sampling -
                         (powers.noise + std::max(0.0, ripple2)) / frames;
  // What a mosaic's gaps add goes with the exponential of the spot's width squared,
  // which its skirts make too large: a channel with so little beyond it can't tell.
  constexpr double kUnsure = 3;
  if (powers.sampling == 0 || lasting > kUnsure * powers.sampling) {
    speckle2_ += lasting * powers.pixels_a_spot * static_cast<double>(ways);
    speckle_channels_ += 1;
  }
  channels_ += 1;
}

LightNoise LightNoiseSums::Result() const {
  LightNoise noise;
  const double ripple2 = ripple2_ / channels_;
  const double sigma2 = std::sqrt(ripple2_variance_) / channels_;
  constexpr double kSignificant = 4;
  if (ripple2 > kSignificant * sigma2) {
    noise.ripple = std::sqrt(ripple2);
    noise.ripple_sigma = 0.5 * sigma2 / noise.ripple;
  }
  noise.speckle_contrast =
      std::sqrt(std::max(0.0, speckle2_ / std::max(1.0, speckle_channels_)));
  return noise;
}

}  // namespace nacre::calibrate::internal
