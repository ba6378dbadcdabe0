// What calibration misses on the simulated rigs: reprojection, laser map, flux scale
// and what it states of them, for seeds that were used for nothing else. The truth is
// what the rig file says.
//
//   calibrate_error [RIG.toml [SEED…]]      without: the hard rig and the mosaic's

#include "acquire/capture.h"
#include "calibrate/calibrate.h"
#include "core/toml.h"
#include "rigs/optics.h"
#include "rigs/simulated_rig.h"

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fmt/format.h>
#include <numeric>
#include <string>
#include <vector>

namespace {

using nacre::calibrate::Calibration;

// kΦ of every channel: electrons a µs and radiance times power, over electrons a count;
// the flat field is relative to its mean.
std::vector<double> TrueFluxScales(const std::filesystem::path& rig_toml) {
  const nacre::TomlTable simulated =
      nacre::TomlTable::FromFile(rig_toml).Table("simulated");
  const nacre::TomlTable camera = simulated.Table("camera");
  const int width = camera.Integer("width_px");
  const int height = camera.Integer("height_px");
  const std::vector<float> vignetting =
      nacre::rigs::Optics({.vignetting = camera.Number("vignetting", 0.0),
                           .vignetting_shift = camera.Number("vignetting_shift", 0.0)},
                          width,
                          height)
          .vignetting();
  const double mean = vignetting.empty()
                          ? 1
                          : std::accumulate(vignetting.begin(), vignetting.end(), 0.0) /
                                static_cast<double>(vignetting.size());
  const std::vector<double> sensitivity =
      camera.Numbers("electrons_per_us_per_radiance");
  const std::vector<double> power_mw = simulated.Table("laser").Numbers("power_mw");
  const double per_count = camera.Number("electrons_per_count", 6.0);
  const auto filters = simulated.FindTable("filters");
  constexpr const char* kColours[] = {"red", "green", "blue"};
  std::vector<double> scales;
  for (std::size_t c = 0; c < power_mw.size(); ++c) {
    double best = filters ? 0 : 1;  // rates are as of the colour that sees most
    for (const char* colour : kColours) {
      best = filters ? std::max(best, filters->Numbers(colour)[c]) : best;
    }
    scales.push_back(sensitivity[c] * power_mw[c] * mean * best / per_count);
  }
  return scales;
}

Calibration Run(const std::filesystem::path& rig_toml, std::uint64_t seed) {
  const std::filesystem::path folder = std::filesystem::temp_directory_path() /
                                       fmt::format("nacre-calibrate-error-{}", seed);
  std::filesystem::remove_all(folder);
  nacre::rigs::SimulatedRig rig(rig_toml, {.seed = seed});
  auto session = nacre::acquire::SessionWriter::Create(
      folder,
      nacre::acquire::MakeManifest(
          rig.description(), rig.camera().Info(), rig.illuminator().Info(), seed),
      false);
  nacre::acquire::CaptureCalibration(session,
                                     {rig.camera(), rig.illuminator(), rig.stage()});
  Calibration calibration =
      nacre::calibrate::Calibrate(nacre::acquire::SessionReader(folder), {});
  std::filesystem::remove_all(folder);
  return calibration;
}

void Print(const std::filesystem::path& rig_toml, std::uint64_t seed) {
  const Calibration c = Run(rig_toml, seed);
  const double pitch_mm =
      nacre::TomlTable::FromFile(rig_toml).Table("grid").Number("pitch_mm");
  std::string flux;
  const std::vector<double> truth = TrueFluxScales(rig_toml);
  for (std::size_t k = 0; k < truth.size(); ++k) {
    const nacre::calibrate::ChannelResponse& channel = c.channels[k];
    flux += fmt::format("{}{:+.2f} ({:.2f})",
                        k > 0 ? ", " : "",
                        100 * (channel.flux_scale_counts_mm2_sr_per_us / truth[k] - 1),
                        100 * channel.flux_scale_sigma);
  }
  std::string spots;
  for (const auto& s : c.corrections.spots) {
    spots += fmt::format("{}{:.4f} {:+.4f} {:.4f}",
                         spots.empty() ? "" : ", ",
                         s.xx_mm2,
                         s.xy_mm2,
                         s.yy_mm2);
  }
  std::printf("| %s | %llu | %.3f | %.2f | %s | %.3f +- %.3f | %s |\n",
              rig_toml.stem().c_str(),
              static_cast<unsigned long long>(seed),
              c.reprojection_rms_px,
              100 * c.laser_map_held_out_rms_mm / pitch_mm,
              flux.c_str(),
              c.gain_electrons_per_count,
              c.gain_sigma_electrons_per_count,
              spots.c_str());
  for (const auto& warning : c.corrections.warnings) {
    std::fprintf(stderr, "%s: %s\n", warning.name.c_str(), warning.text.c_str());
  }
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::filesystem::path> rigs = {
      NACRE_RIGS_FOLDER "/simulated-hard-chessboard.toml",
      NACRE_RIGS_FOLDER "/simulated-bayer-chessboard.toml"};
  std::vector<std::uint64_t> seeds = {41001, 41002, 41003};
  if (argc > 1) {
    rigs = {argv[1]};
  }
  if (argc > 2) {
    seeds.clear();
  }
  for (int k = 2; k < argc; ++k) {
    seeds.push_back(std::stoull(argv[k]));
  }
  std::printf(
      "| rig | seed | reprojection, px rms | laser map held out, %% of pitch | flux "
      "scale off (stated), %% | gain, e-/count | spot xx xy yy, mm2 |\n"
      "|---|---|---|---|---|---|---|\n");
  for (const auto& rig : rigs) {
    for (const std::uint64_t seed : seeds) {
      Print(rig, seed);
    }
  }
  return 0;
}
