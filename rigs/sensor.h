#pragma once

#include "core/options.h"

#include <cstdint>
#include <span>
#include <vector>

namespace nacre::rigs {

/// An image sensor as in the linear model of [EMVA1288]: photo-electrons and dark
/// electrons are Poisson distributed, the well holds so many, reading adds Gaussian
/// noise, and the converter rounds to whole counts.
struct SensorModel {
  double full_well_electrons = 25000;
  double read_noise_electrons = 5;
  double electrons_per_count = 6;
  double offset_counts = 64;
  double dark_electrons_per_us = 2e-5;
  int bit_depth = 12;
  // What a good sensor hasn't; off by default.
  double dark_spread = 0;           ///< of pixels' dark current, relative
  double hot_fraction = 0;          ///< of pixels
  double hot_electrons_per_us = 0;  ///< mean dark current of a hot one, exponential
  double row_noise_electrons = 0;   ///< common to a row, anew in every picture
  double nonlinearity = 0;          ///< share of the electrons lost at full well
  double blooming = 0;  ///< share of what a well can't hold that its column gets

  int MaxCount() const { return (1 << bit_depth) - 1; }

  template <class Self, class Visitor>
  static void Visit(Self& self, Visitor&& visit) {
    visit("full_well_electrons", self.full_well_electrons, Range{100, 1e7}, "");
    visit("read_noise_electrons", self.read_noise_electrons, Range{0, 1e4}, "");
    visit("electrons_per_count", self.electrons_per_count, Range{1e-3, 1e4}, "");
    visit("offset_counts", self.offset_counts, Range{0, 1e4}, "");
    visit("dark_electrons_per_us", self.dark_electrons_per_us, Range{0, 1e3}, "");
    visit("bit_depth", self.bit_depth, Range{8, 16}, "");
    visit("dark_spread", self.dark_spread, Range{0, 10}, "");
    visit("hot_fraction", self.hot_fraction, Range{0, 0.1}, "");
    visit("hot_electrons_per_us", self.hot_electrons_per_us, Range{0, 1e3}, "");
    visit("row_noise_electrons", self.row_noise_electrons, Range{0, 1e4}, "");
    visit("nonlinearity", self.nonlinearity, Range{0, 0.45}, "");
    visit("blooming", self.blooming, Range{0, 1}, "");
  }
};

/// One picture: counts[k] for the mean rate rates[k], electrons per µs, exposed for
/// `exposure_us`. The noise is a pure function of (seed, picture_number, k), whatever
/// the thread count.
struct Exposure {
  double exposure_us = 0;
  std::uint64_t seed = 0;
  std::uint64_t picture_number = 0;
  int row_px = 0;  ///< pixels a row, of which row noise needs to know
};
void Expose(const SensorModel& sensor,
            const Exposure& exposure,
            std::span<const float> rates_electrons_per_us,
            std::span<std::uint16_t> counts,
            int thread_count = 0);

/// A whole sensor: beside the above its pixels' own dark currents, which are a pure
/// function of the seed, and the charge that flows over.
class Sensor {
 public:
  Sensor(const SensorModel& model, int width_px, int height_px, std::uint64_t seed);

  void Expose(Exposure exposure,
              std::span<const float> rates_electrons_per_us,
              std::span<std::uint16_t> counts,
              int thread_count = 0) const;

  /// Beyond the model's, electrons per µs a pixel; empty if all are the same.
  const std::vector<float>& dark_excess() const { return dark_excess_; }

 private:
  SensorModel model_;
  int width_;
  int height_;
  std::uint64_t seed_;
  std::vector<float> dark_excess_;
};

}  // namespace nacre::rigs
