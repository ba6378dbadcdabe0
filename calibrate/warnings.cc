#include "calibrate/warnings.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <utility>

namespace nacre::calibrate {
namespace {

class List {
 public:
  void AddIf(bool is_so, const char* name, std::string text) {
    if (is_so) {
      warnings_.push_back({name, std::move(text)});
    }
  }
  std::vector<Warning> Take() { return std::move(warnings_); }

 private:
  std::vector<Warning> warnings_;
};

void WarnOfSensor(const Calibration& calibration,
                  const WarningFacts& facts,
                  List& list) {
  const Corrections& c = calibration.corrections;
  const double full = calibration.saturation_counts;
  const double bend = c.linearity.Linear(full) / full - 1;
  constexpr double kBend = 0.003;
  list.AddIf(
      std::abs(bend) > kBend && std::abs(bend) > 4 * c.linearity.sigma_at_saturation,
      "nonlinear-response",
      fmt::format("at saturation the sensor is {:.2f} % off a straight line "
                  "(+- {:.2f} %); corrected",
                  100 * bend,
                  100 * c.linearity.sigma_at_saturation));
  double hottest = 0;
  for (const HotPixel& pixel : c.hot_pixels) {
    hottest = std::max(hottest, pixel.rate_counts_per_us);
  }
  list.AddIf(!c.hot_pixels.empty(),
             "hot-pixels",
             fmt::format("{} pixels are hot, by up to {:.0f} counts in the longest "
                         "exposure; left out",
                         c.hot_pixels.size(),
                         hottest * facts.longest_exposure_us));
  list.AddIf(c.row_noise_counts > 0.05,
             "row-noise",
             fmt::format("rows of a picture share {:.2f} counts of noise; part of the "
                         "stated variance, but neighbours aren't independent",
                         c.row_noise_counts));
  list.AddIf(c.blooming.reach_px > 0,
             "blooming",
             fmt::format("overexposed pixels spill {} pixels along their column; "
                         "neighbours of saturated pixels are to be left out",
                         c.blooming.reach_px));
  const double dark = calibration.dark.rate_counts_per_us * facts.longest_exposure_us;
  list.AddIf(
      dark > 5,
      "dark-current",
      fmt::format("dark current fills {:.0f} counts of the longest exposure, its "
                  "noise {:.1f}; subtracted",
                  dark,
                  std::sqrt(dark / calibration.gain_electrons_per_count)));
  const double read = calibration.read_noise_electrons;
  list.AddIf(
      read > 15,
      "read-noise",
      fmt::format("read noise is {:.1f} electrons; in the stated variance", read));
}

void WarnOfLens(const Calibration& calibration, const WarningFacts& facts, List& list) {
  const Corrections& c = calibration.corrections;
  if (!c.flat_field.empty()) {
    const std::vector<float> map = c.flat_field.Map(32, 32);
    const auto [low, high] = std::minmax_element(map.begin(), map.end());
    const double fall = 1 - static_cast<double>(*low) / static_cast<double>(*high);
    list.AddIf(
        fall > 0.02,
        "vignetting",
        fmt::format("the picture's corners get {:.0f} % less light; corrected to "
                    "{:.2f} %",
                    100 * fall,
                    100 * c.flat_field.sigma));
    list.AddIf(
        facts.flat_residual > 3 * facts.flat_noise && facts.flat_residual > 0.003,
        "uneven-flat-field",
        fmt::format("the white card is uneven by {:.2f} % beyond what is smooth "
                    "(photons: {:.2f} %); not corrected. Dust, or an uneven lamp?",
                    100 * facts.flat_residual,
                    100 * facts.flat_noise));
  }
  list.AddIf(
      !c.glare.empty() && c.glare.fraction > 0.002,
      "glare",
      fmt::format("{:.2f} +- {:.2f} % of the light is scattered {:.0f} pixels and "
                  "farther; corrected to about its own uncertainty",
                  100 * c.glare.fraction,
                  100 * c.glare.fraction_sigma,
                  c.glare.empty() ? 0 : c.glare.radius_px.front()));
}

void WarnOfLaser(const Calibration& calibration,
                 const WarningFacts& facts,
                 List& list) {
  const Corrections& c = calibration.corrections;
  list.AddIf(c.light_noise.ripple > 0.002,
             "power-ripple",
             fmt::format("a spot's power ripples by {:.2f} +- {:.2f} % from picture to "
                         "picture; can't be corrected, part of sigma",
                         100 * c.light_noise.ripple,
                         100 * c.light_noise.ripple_sigma));
  list.AddIf(
      c.light_noise.speckle_contrast > 0.02,
      "speckle",
      fmt::format("spots differ as by speckle of contrast {:.1f} % a pixel; can't "
                  "be corrected",
                  100 * c.light_noise.speckle_contrast));
  const double lag =
      std::max(std::abs(c.hysteresis.x_rad), std::abs(c.hysteresis.y_rad));
  const double mm_per_rad =
      calibration.scan_map.half_width_mm / calibration.scan_map.half_width_rad;
  list.AddIf(
      lag > 4 * c.hysteresis.sigma_rad && lag * mm_per_rad > 0.003 * facts.pitch_mm,
      "mirror-hysteresis",
      fmt::format("the mirrors stop {:.4f} mm short of where they are sent, from "
                  "either side; known and allowed for",
                  lag * mm_per_rad));
  list.AddIf(
      facts.missed_spots > 0,
      "missed-spots",
      fmt::format("{} spots of the lattice weren't found, or far from where they "
                  "should be; left out",
                  facts.missed_spots));
  list.AddIf(
      calibration.laser_map_held_out_rms_mm > 0.02 * facts.pitch_mm,
      "laser-map",
      fmt::format("spots that had no part in the laser map are missed by {:.4f} mm "
                  "rms, {:.1f} % of the pitch",
                  calibration.laser_map_held_out_rms_mm,
                  100 * calibration.laser_map_held_out_rms_mm / facts.pitch_mm));
  for (std::size_t k = 0; k < c.spots.size(); ++k) {
    const SpotProfile& s = c.spots[k];
    const double mean = 0.5 * (s.xx_mm2 + s.yy_mm2);
    const double half = std::hypot(0.5 * (s.xx_mm2 - s.yy_mm2), s.xy_mm2);
    const double longer = std::sqrt(std::max(0.0, mean + half));
    const double shorter = std::sqrt(std::max(1e-12, mean - half));
    const CameraGeometry& camera = calibration.camera;
    const double pixel_mm =
        std::sqrt(camera.FootprintMm2({0.5 * camera.width_px, 0.5 * camera.height_px}));
    constexpr double kWidePx = 1.5;
    list.AddIf(longer > kWidePx * pixel_mm,
               "blurred-spot",
               fmt::format("the spot of channel {} has a standard deviation of {:.1f} "
                           "pixels or more: its skirt passes for glare, and the flux "
                           "scale may be off by per cents. Is the lens in focus?",
                           calibration.channels[k].name,
                           longer / pixel_mm));
    constexpr double kNarrow = 0.4;  // of a plane's pixels: 5 % of its light by chance
    list.AddIf(
        !c.filters.mosaic.empty() && shorter < kNarrow * 2 * pixel_mm,
        "undersampled-spot",
        fmt::format("the spot of channel {} has a standard deviation of {:.2f} pixels: "
                    "between those of one colour part of it is lost, and the flux "
                    "scale may be off by per cents. Widen it, or defocus a little",
                    calibration.channels[k].name,
                    shorter / pixel_mm));
    list.AddIf(longer > 1.15 * shorter && half > 4 * s.sigma_mm2,
               "long-spot",
               fmt::format("the spot of channel {} isn't round: {:.3f} by {:.3f} mm "
                           "(standard deviations, lens included)",
                           calibration.channels[k].name,
                           longer,
                           shorter));
  }
}

}  // namespace

std::vector<Warning> WarningsOf(const Calibration& calibration,
                                const WarningFacts& facts) {
  List list;
  WarnOfSensor(calibration, facts, list);
  WarnOfLens(calibration, facts, list);
  WarnOfLaser(calibration, facts, list);
  const Corrections& c = calibration.corrections;
  const double ambient = std::max(std::abs(c.ambient.At(0, 0)),
                                  std::abs(facts.reference_ambient.At(0, 0)));
  list.AddIf(ambient > 0,
             "ambient-light",
             fmt::format("{:.2f} counts of ambient light in the longest exposure; "
                         "subtracted as it was with the laser off",
                         ambient * facts.longest_exposure_us));
  return list.Take();
}

}  // namespace nacre::calibrate
