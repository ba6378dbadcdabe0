#include "reconstruct/internal/systematics.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace nacre::reconstruct::internal {
namespace {

// The window of one channel.
struct Window {
  std::span<const float> rd;
  int core;

  // d ln R_d per cell from neighbours on either side; 0 if noise hides it.
  float LogSlope(int at, int step, int place) const {
    const int before = place > 0 ? at - step : at;
    const int after = place + 1 < core ? at + step : at;
    const float low = rd[static_cast<std::size_t>(before)];
    const float high = rd[static_cast<std::size_t>(after)];
    const auto steps = (after - before) / step;
    const auto cells = static_cast<float>(steps);
    return low > 0 && high > 0 && cells > 0 ? std::log(high / low) / cells : 0.0F;
  }
};

}  // namespace

void AddSystematics(const RdHeader& header,
                    const calibrate::Calibration& calibration,
                    double longest_us,
                    RdSlice& slice) {
  const auto window_size = static_cast<std::size_t>(header.WindowSize());
  const double held_out = calibration.laser_map_held_out_rms_mm;
  // Along one axis, in cells.
  const double off = (held_out > 0 ? held_out : calibration.laser_map_rms_mm) /
                     std::sqrt(2.0) / header.pitch_mm;
  const calibrate::PixelPoint middle{0.5 * calibration.camera.width_px,
                                     0.5 * calibration.camera.height_px};
  const double rows =
      header.pitch_mm / std::sqrt(calibration.camera.FootprintMm2(middle));
  for (std::size_t c = 0; c < header.channels.size(); ++c) {
    const double flux = calibration.channels[c].flux_scale_sigma;
    const double ripple = calibration.corrections.light_noise.ripple;
    const double flat = calibration.corrections.flat_field.sigma;
    const double speckle = calibration.corrections.light_noise.speckle_contrast / rows;
    const auto scale2 = static_cast<float>(flux * flux + ripple * ripple + flat * flat +
                                           speckle * speckle);
    const double row =
        calibration.RdPerRate(static_cast<int>(c), {0, 0}, {0, 0}, header.eta) *
        calibration.corrections.row_noise_counts / longest_us;
    const double row2 = row * row / rows;  // no float, if R_d is of another unit
    const auto off2 = static_cast<float>(off * off);
    const Window window{std::span(slice.rd).subspan(c * window_size, window_size),
                        header.core};
    for (int v = 0; v < header.core; ++v) {
      for (int u = 0; u < header.core; ++u) {
        const int cell = v * header.core + u;
        const auto at = c * window_size + static_cast<std::size_t>(cell);
        if (slice.valid[at] == 0) {
          continue;
        }
        const float along_x = window.LogSlope(cell, 1, u);
        const float along_y = window.LogSlope(cell, header.core, v);
        const float relative2 = scale2 + off2 * (along_x * along_x + along_y * along_y);
        const auto sigma = static_cast<double>(slice.sigma[at]);
        const auto rd = static_cast<double>(slice.rd[at]);
        slice.sigma[at] = static_cast<float>(
            std::sqrt(sigma * sigma + row2 + static_cast<double>(relative2) * rd * rd));
      }
    }
  }
}

}  // namespace nacre::reconstruct::internal
