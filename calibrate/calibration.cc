#include "calibrate/calibration.h"

#include "core/error.h"
#include "core/fresnel.h"

#include <cmath>
#include <numbers>

namespace nacre::calibrate {
namespace {

// An integral, and always of the same index: callers ask for a pixel at a time.
double CachedExitNormalization(double eta) {
  thread_local double last_eta = 0;
  thread_local double last_value = 0;
  if (eta != last_eta) {
    last_value = ExitNormalization(eta);
    last_eta = eta;
  }
  return last_value;
}

}  // namespace

double Calibration::CosIn(PointMm point) const {
  const acquire::ScanAngle angle = scan_map.AngleFromSample(point);
  const double tan_x = std::tan(angle.x_rad);
  const double tan_y = std::tan(angle.y_rad);
  return 1 / std::sqrt(1 + tan_x * tan_x + tan_y * tan_y);
}

double Calibration::RdPerRate(int channel, PointMm x_i, PointMm x_o, double eta) const {
  const auto c = static_cast<std::size_t>(channel);
  Expect(c < channels.size(), "a channel of the calibration");
  const double transmittance = FresnelTransmittance(CosIn(x_i), eta) *
                               FresnelTransmittance(camera.CosOut(x_o), eta);
  return std::numbers::pi * CachedExitNormalization(eta) /
         (transmittance * channels[c].flux_scale_counts_mm2_sr_per_us);
}

double Calibration::VarianceCounts2(double signal_counts) const {
  const double read_counts = read_noise_electrons / gain_electrons_per_count;
  constexpr double kRounding = 1.0 / 12;
  const double row_counts = corrections.row_noise_counts;
  return signal_counts / gain_electrons_per_count + read_counts * read_counts +
         row_counts * row_counts + kRounding;
}

}  // namespace nacre::calibrate
