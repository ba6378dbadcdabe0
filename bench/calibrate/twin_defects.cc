// Every defect of the twins, switched on alone at five times the hard rig's value: what
// calibration finds of it, what it does to geometry, laser map and flux scale, and
// which warnings name it. Prints the table of docs/twin-defects.md.
//
//   twin_defects [SEED [NAME]]

#include "acquire/capture.h"
#include "calibrate/calibrate.h"
#include "calibrate/session_state.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "rigs/optics.h"
#include "rigs/simulated_rig.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fmt/format.h>
#include <functional>
#include <numeric>
#include <string>
#include <vector>

namespace {

using nacre::calibrate::Calibration;
using nacre::calibrate::SessionState;

constexpr double kPitchMm = 1.96875;

struct Found {
  Calibration calibration;
  SessionState state;
};

struct Defect {
  const char* name;
  const char* table;  // of [simulated]
  const char* lines;
  std::function<std::string(const Found&)> found;
  const char* camera = "";  // what it takes of the camera besides
};

double Longer(const Found& f) {
  const auto& s = f.calibration.corrections.spots[0];
  return std::sqrt(0.5 * (s.xx_mm2 + s.yy_mm2) +
                   std::hypot(0.5 * (s.xx_mm2 - s.yy_mm2), s.xy_mm2));
}

const std::vector<Defect>& Defects() {
  using F = const Found&;
  static const std::vector<Defect> defects = {
      {"none",
       "camera",
       "",
       [](F f) {
         return fmt::format("sample {:+.3f} +- {:.3f} mm high",
                            f.state.plane.height_mm,
                            f.state.plane.height_sigma_mm);
       }},
      {"radial distortion",
       "camera",
       "k1 = -0.6\nk2 = 0.1",
       [](F f) { return fmt::format("k1 {:.3f}", f.calibration.camera.k1); }},
      {"tangential distortion",
       "camera",
       "p1 = 2e-3\np2 = -1.5e-3",
       [](F f) {
         return fmt::format(
             "p1 {:.5f}, p2 {:.5f}", f.calibration.camera.p1, f.calibration.camera.p2);
       }},
      {"oblique camera",
       "camera",
       "tilt_deg = 45.0",
       [](F f) {
         return fmt::format("{:.2f} deg",
                            std::acos(f.calibration.camera.CosOut({0, 0})) * 57.29578);
       }},
      {"defocus",
       "camera",
       "defocus_sigma_px = 3.0",
       [](F f) { return fmt::format("spot {:.3f} mm", Longer(f)); }},
      {"veiling glare",
       "camera",
       "glare_fraction = 0.15",
       [](F f) {
         return fmt::format("{:.1f} % beyond {:.0f} px",
                            100 * f.calibration.corrections.glare.fraction,
                            f.calibration.corrections.glare.empty()
                                ? 0
                                : f.calibration.corrections.glare.radius_px[0]);
       }},
      {"vignetting",
       "camera",
       "vignetting = 0.95\nvignetting_shift = 0.1",
       [](F f) {
         const auto map = f.calibration.corrections.flat_field.Map(32, 32);
         const auto [low, high] = std::minmax_element(map.begin(), map.end());
         return fmt::format("{:.0f} %", 100 * (1 - static_cast<double>(*low / *high)));
       }},
      {"read noise",
       "camera",
       "read_noise_electrons = 25.0",
       [](F f) {
         return fmt::format("{:.2f} e-", f.calibration.read_noise_electrons);
       }},
      {"dark current",
       "camera",
       "dark_electrons_per_us = 1e-4\ndark_spread = 1.5",
       [](F f) {
         return fmt::format("{:.3g} e-/us",
                            f.calibration.dark.rate_counts_per_us *
                                f.calibration.gain_electrons_per_count);
       }},
      {"hot pixels",
       "camera",
       "hot_fraction = 2.5e-3\nhot_electrons_per_us = 2.5e-2",
       [](F f) {
         return fmt::format("{} of 185", f.calibration.corrections.hot_pixels.size());
       }},
      {"row noise",
       "camera",
       "row_noise_electrons = 7.5",
       [](F f) {
         return fmt::format("{:.2f} e-",
                            f.calibration.corrections.row_noise_counts *
                                f.calibration.gain_electrons_per_count);
       }},
      {"coarse converter",
       "camera",
       "bit_depth = 10\nelectrons_per_count = 24.0",
       [](F f) {
         return fmt::format("{:.2f} e-/count", f.calibration.gain_electrons_per_count);
       }},
      {"blooming",
       "camera",
       "blooming = 1.0",
       [](F f) {
         return fmt::format("{} px", f.calibration.corrections.blooming.reach_px);
       }},
      {"bent response",
       "camera",
       "nonlinearity = 0.05",
       [](F f) {
         const double full = f.calibration.saturation_counts;
         return fmt::format(
             "{:.2f} % at saturation",
             100 * (f.calibration.corrections.linearity.Linear(full) / full - 1));
       }},
      {"colour mosaic, sharp spot",
       "filters",
       "mosaic = \"RGGB\"\nred = [0.95, 0.25, 0.05]\ngreen = [0.2, 0.9, 0.4]\nblue = "
       "[0.05, 0.3, 0.9]\nwhite = [0.5, 0.95, 0.6]",
       [](F) { return std::string(); }},
      {"colour mosaic, spot of 1 px",
       "filters",
       "mosaic = \"RGGB\"\nred = [0.95, 0.25, 0.05]\ngreen = [0.2, 0.9, 0.4]\nblue = "
       "[0.05, 0.3, 0.9]\nwhite = [0.5, 0.95, 0.6]",
       [](F f) {
         const auto& lasers = f.calibration.corrections.filters.lasers;
         return fmt::format(
             "green sees {:.3f} of R, {:.3f} of B", lasers[0][1], lasers[2][1]);
       },
       "defocus_sigma_px = 0.9"},
      {"galvo pincushion",
       "laser",
       "separation_mm = 30.0\nrotation_deg = 2.0",
       [](F) { return std::string("laser map"); }},
      {"hysteresis",
       "laser",
       "hysteresis_mrad = 0.25",
       [](F f) {
         return fmt::format("{:.3f}, {:.3f} mrad",
                            1e3 * f.calibration.corrections.hysteresis.x_rad,
                            1e3 * f.calibration.corrections.hysteresis.y_rad);
       }},
      {"wide spot",
       "laser",
       "spot_sigma_mm = 0.6",
       [](F f) { return fmt::format("{:.3f} mm", Longer(f)); }},
      {"long spot",
       "laser",
       "spot_aspect = 2.5\nspot_angle_deg = 30.0",
       [](F f) { return fmt::format("{:.3f} mm the longer way", Longer(f)); }},
      {"power drift",
       "laser",
       "drift_per_hour = 0.05",
       [](F f) {
         return fmt::format("{:.2f} +- {:.2f} %/h",
                            100 * f.state.drift_per_hour,
                            100 * f.state.drift_sigma_per_hour);
       }},
      {"power ripple",
       "laser",
       "ripple = 0.015",
       [](F f) {
         return fmt::format("{:.2f} %",
                            100 * f.calibration.corrections.light_noise.ripple);
       }},
      {"speckle",
       "laser",
       "speckle_contrast = 0.05",
       [](F f) {
         return fmt::format(
             "{:.1f} %", 100 * f.calibration.corrections.light_noise.speckle_contrast);
       }},
      {"ambient light",
       "ambient",
       "electrons_per_us = 0.01\ngradient = 0.3",
       [](F f) {
         return fmt::format("{:.4f} e-/us on the sample",
                            f.calibration.corrections.ambient.At(0, 0) *
                                f.calibration.gain_electrons_per_count);
       }},
      {"sample high and tilted",
       "sample",
       "height_mm = 2.5\ntilt_deg = 2.5\ntilt_azimuth_deg = 60.0",
       [](F f) {
         return fmt::format("{:.3f} +- {:.3f} mm, {:.2f} deg",
                            f.state.plane.height_mm,
                            f.state.plane.height_sigma_mm,
                            57.29578 * std::atan(std::hypot(f.state.plane.slope_x,
                                                            f.state.plane.slope_y)));
       }},
      {"specular reflection",
       "sample",
       "specular_reflectance = 0.25",
       [](F) { return std::string("left to nacre reconstruct"); }},
  };
  return defects;
}

// The hard rig's schedule over a coarser grid, without its defects.
std::string RigText(const Defect& defect) {
  std::string text = R"(kind = "simulated"
[sample]
name = "defects"
eta = 1.5
[grid]
points = [12, 12]
pitch_mm = 3.9375
core = 5
[camera]
exposures_us = [40000, 2000]
dark_frames = 8
target_exposure_us = 12000
flat_exposures_us = [1000, 3000, 6000, 10000, 14000, 18000]
[targets]
checkerboard_columns = 10
checkerboard_rows = 7
checkerboard_square_mm = 5.5
checkerboard_poses = 10
reference_reflectance = 0.99
reference_exposure_us = 100
reference_frames = 16
laser_lattice = 9
reverse_lattice = true
glare_exposures_us = [40000, 2000, 100]
ambient_frames = 4
patch_mm = [37.0, 0.0]
patch_reflectance = 0.03
[scanner]
mm_per_rad = 400.0
[schedule]
spot_spacing_cells = 5
order_seed = 3
[simulated]
phantom = ")" NACRE_RIGS_FOLDER R"(/chessboard4x4-quick.toml"
picture_period_s = 9.0
patch_radius_mm = 2.5
[simulated.lamp]
electrons_per_us = 1.4
[simulated.camera]
width_px = 272
height_px = 272
field_mm = 82.0
electrons_per_us_per_radiance = [6.5, 7.0, 5.5]
@camera
[simulated.laser]
power_mw = [10.0, 8.0, 8.0]
@laser
)";
  const std::string table = defect.table;
  for (const std::string name : {"camera", "laser"}) {
    text.replace(text.find("@" + name),
                 name.size() + 1,
                 table == name      ? defect.lines
                 : name == "camera" ? defect.camera
                                    : "");
  }
  if (table != "camera" && table != "laser") {
    text += "[simulated." + table + "]\n" + defect.lines + "\n";
  }
  return text;
}

Found Run(const Defect& defect,
          std::uint64_t seed,
          const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  nacre::WriteFile(folder / "rig.toml", RigText(defect));
  nacre::rigs::SimulatedRig rig(folder / "rig.toml", {.seed = seed});
  auto session = nacre::acquire::SessionWriter::Create(
      folder / "s",
      nacre::acquire::MakeManifest(
          rig.description(), rig.camera().Info(), rig.illuminator().Info(), seed),
      false);
  const nacre::acquire::Devices devices{rig.camera(), rig.illuminator(), rig.stage()};
  nacre::acquire::CaptureCalibration(session, devices);
  const Calibration calibration =
      nacre::calibrate::Calibrate(nacre::acquire::SessionReader(folder / "s"), {});
  nacre::acquire::CaptureGrid(session, devices, calibration.scan_map);
  return {calibration,
          nacre::calibrate::ExamineSession(nacre::acquire::SessionReader(folder / "s"),
                                           calibration)};
}

// The worst channel's.
double FluxError(const Defect& defect, const Calibration& calibration) {
  const std::string lines = defect.lines;
  const double per_count = lines.find("bit_depth") != std::string::npos ? 24 : 6;
  double mean = 1;
  if (lines.find("vignetting") != std::string::npos) {
    const auto v =
        nacre::rigs::Optics({.vignetting = 0.95, .vignetting_shift = 0.1}, 272, 272)
            .vignetting();
    mean = std::accumulate(v.begin(), v.end(), 0.0) / static_cast<double>(v.size());
  }
  std::array truth = {6.5 * 10, 7.0 * 8, 5.5 * 8};
  if (lines.find("mosaic") != std::string::npos) {
    truth = {0.95 * truth[0], 0.9 * truth[1], 0.9 * truth[2]};
  }
  double worst = 0;
  for (std::size_t c = 0; c < truth.size(); ++c) {
    const double error = calibration.channels[c].flux_scale_counts_mm2_sr_per_us /
                             (truth[c] * mean / per_count) -
                         1;
    worst = std::abs(error) > std::abs(worst) ? error : worst;
  }
  return worst;
}

void Print(const Defect& defect, std::uint64_t seed) {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() /
      fmt::format("nacre-defects-{}-{}", seed, defect.table);
  std::filesystem::remove_all(folder);
  std::string set = defect.lines;
  set += std::string(*defect.camera != '\0' ? " " : "") + defect.camera;
  std::replace(set.begin(), set.end(), '\n', ' ');
  std::string row = fmt::format("| {} | `{}` |", defect.name, set);
  try {
    const Found found = Run(defect, seed, folder);
    const Calibration& c = found.calibration;
    std::string warnings;
    for (const auto* list : {&c.corrections.warnings, &found.state.warnings}) {
      for (const auto& warning : *list) {
        if (warnings.find(warning.name) == std::string::npos) {
          warnings += (warnings.empty() ? "" : ", ") + warning.name;
        }
      }
    }
    row += fmt::format(" {} | {:.3f} | {:.2f} | {:+.2f} | {} |",
                       defect.found(found),
                       c.reprojection_rms_px,
                       100 * c.laser_map_held_out_rms_mm / kPitchMm,
                       100 * FluxError(defect, c),
                       warnings.empty() ? "-" : warnings);
  } catch (const nacre::Error& e) {
    std::string text = e.what();
    row += " refused: " + text.substr(text.rfind("/") + 1) + " | | | | |";
  }
  std::filesystem::remove_all(folder);
  std::printf("%s\n", row.c_str());
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  const std::uint64_t seed = argc > 1 ? std::stoull(argv[1]) : 51001;
  const std::string only = argc > 2 ? argv[2] : "";
  std::printf(
      "| defect | set to | found | reprojection, px rms | laser map held out, %% of "
      "pitch | flux scale, %% off | warnings |\n|---|---|---|---|---|---|---|\n");
  for (const Defect& defect : Defects()) {
    if (only.empty() || only == defect.name) {
      Print(defect, seed);
    }
  }
  return 0;
}
