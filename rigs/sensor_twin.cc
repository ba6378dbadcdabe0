#include "core/error.h"
#include "core/random.h"
#include "rigs/sensor.h"

#include <algorithm>
#include <cmath>

namespace nacre::rigs {
namespace {

constexpr std::uint64_t kDarkStream = 0x6461726BU;

// Charge beyond the well runs up and down its column, half each way, until pixels with
// room have taken it or the sensor ends.
void Spill(
    double charge, int from, int step, std::vector<double>& column, double well) {
  const auto end = static_cast<int>(std::ssize(column));
  for (int y = from + step; y >= 0 && y < end && charge > 0; y += step) {
    double& electrons = column[static_cast<std::size_t>(y)];
    const double taken = std::min(charge, std::max(0.0, well - electrons));
    electrons += taken;
    charge -= taken;
  }
}

// Of the mean charges: which electrons go astray is noise already.
void Bloom(const SensorModel& model,
           double exposure_us,
           int width,
           std::vector<float>& rates) {
  const double limit =
      model.full_well_electrons / exposure_us - model.dark_electrons_per_us;
  const auto stride = static_cast<std::size_t>(width);
  std::vector<double> column(rates.size() / stride);
  for (std::size_t x = 0; x < stride; ++x) {
    double brightest = 0;
    for (std::size_t y = 0; y < column.size(); ++y) {
      column[y] = static_cast<double>(rates[y * stride + x]);
      brightest = std::max(brightest, column[y]);
    }
    if (brightest <= limit) {
      continue;
    }
    for (std::size_t y = 0; y < column.size(); ++y) {
      const double excess = static_cast<double>(rates[y * stride + x]) - limit;
      if (excess > 0) {
        Spill(0.5 * model.blooming * excess, static_cast<int>(y), -1, column, limit);
        Spill(0.5 * model.blooming * excess, static_cast<int>(y), +1, column, limit);
      }
    }
    for (std::size_t y = 0; y < column.size(); ++y) {
      rates[y * stride + x] = static_cast<float>(column[y]);
    }
  }
}

}  // namespace

Sensor::Sensor(const SensorModel& model,
               int width_px,
               int height_px,
               std::uint64_t seed)
    : model_(model), width_(width_px), height_(height_px), seed_(seed) {
  if (model.dark_spread <= 0 && model.hot_fraction <= 0) {
    return;
  }
  RandomStream random(seed, kDarkStream);
  const std::size_t count =
      static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px);
  dark_excess_.reserve(count);
  for (std::size_t k = 0; k < count; ++k) {
    // Log-normal, as the traps behind it multiply; of mean 1.
    const double u = std::max(random.Uniform(), 0x1p-33);
    const double v = random.Uniform();
    const double normal = std::sqrt(-2 * std::log(u)) * std::cos(6.283185307179586 * v);
    const double s2 = std::log1p(model.dark_spread * model.dark_spread);
    double excess =
        model.dark_electrons_per_us * (std::exp(std::sqrt(s2) * normal - 0.5 * s2) - 1);
    const bool is_hot = random.Uniform() < model.hot_fraction;
    const double hot = -std::log(std::max(random.Uniform(), 0x1p-33));
    if (is_hot) {
      excess += model.hot_electrons_per_us * hot;
    }
    dark_excess_.push_back(static_cast<float>(excess));
  }
}

void Sensor::Expose(Exposure exposure,
                    std::span<const float> rates_electrons_per_us,
                    std::span<std::uint16_t> counts,
                    int thread_count) const {
  exposure.seed = seed_;
  exposure.row_px = width_;
  if (dark_excess_.empty() && model_.blooming <= 0) {
    rigs::Expose(model_, exposure, rates_electrons_per_us, counts, thread_count);
    return;
  }
  std::vector<float> rates(rates_electrons_per_us.begin(),
                           rates_electrons_per_us.end());
  for (std::size_t k = 0; k < dark_excess_.size(); ++k) {
    rates[k] += dark_excess_[k];
  }
  if (model_.blooming > 0) {
    Bloom(model_, exposure.exposure_us, width_, rates);
  }
  rigs::Expose(model_, exposure, rates, counts, thread_count);
}

}  // namespace nacre::rigs
