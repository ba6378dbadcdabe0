// The whole line with a colour camera: capture, calibration and reconstruction of the
// shipped rig, on fewer points, against the phantom's truth.

#include "acquire/capture.h"
#include "calibrate/calibrate.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "reconstruct/rd_dataset.h"
#include "reconstruct/reconstruct.h"
#include "rigs/simulated_rig.h"
#include "rigs/transport/transport.h"
#include "tests/support/error_message.h"
#include "tests/support/temp_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace nacre::reconstruct {
namespace {

using nacre::testing::ErrorMessage;
using nacre::testing::TempFolder;

constexpr const char* kGrid = "points = [24, 24]\npitch_mm = 1.96875\ncore = 11";
constexpr const char* kSmallGrid = "points = [6, 6]\npitch_mm = 1.96875\ncore = 7";

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

void WriteRig(const TempFolder& folder) {
  const std::filesystem::path rigs(NACRE_RIGS_FOLDER);
  WriteFile(folder / "chessboard4x4-quick.toml",
            Replaced(ReadFile(rigs / "chessboard4x4-quick.toml"), kGrid, kSmallGrid));
  WriteFile(
      folder / "rig.toml",
      Replaced(ReadFile(rigs / "simulated-bayer-chessboard.toml"), kGrid, kSmallGrid) +
          "\n[simulated.sample]\nspecular_reflectance = 0.05\n");
}

// Errors of the cells brighter than a hundredth of the peak, the lit one and its eight
// neighbours left out.
struct Errors {
  double square = 0;
  double count = 0;
  double measured = 0;
  double truth = 0;
  double within = 0;
  double lit = 0;  // Σ of the lit cells
  double lit_truth = 0;

  void Add(double rd, double sigma, double expected) {
    square += std::pow(rd / expected - 1, 2);
    count += 1;
    measured += rd;
    truth += expected;
    within += std::abs(rd - expected) <= sigma ? 1 : 0;
  }
  double Rms() const { return std::sqrt(square / count); }
  double Bias() const { return measured / truth - 1; }
};

std::vector<Errors> Compare(const std::filesystem::path& rd,
                            const rigs::Transport& truth) {
  RdReader reader(rd);
  const RdHeader& header = reader.header();
  std::vector<Errors> errors(header.channels.size());
  const std::size_t window = static_cast<std::size_t>(header.WindowSize());
  for (int j = 0; j < header.points_y; ++j) {
    for (int i = 0; i < header.points_x; ++i) {
      const RdSlice slice = reader.ReadSlice(i, j);
      const PointMm x_i = header.GridPoint(i, j);
      const std::vector<float> expected = truth.WindowAround({x_i.x, x_i.y}).rd;
      for (std::size_t c = 0; c < errors.size(); ++c) {
        const float peak = expected[c * window + window / 2];
        for (std::size_t k = 0; k < window; ++k) {
          const std::size_t at = c * window + k;
          if (k == window / 2) {
            errors[c].lit += static_cast<double>(slice.rd[at]);
            errors[c].lit_truth += static_cast<double>(expected[at]);
          }
          const int du = static_cast<int>(k) % header.core - header.Radius();
          const int dv = static_cast<int>(k) / header.core - header.Radius();
          if (std::max(std::abs(du), std::abs(dv)) > 1 && slice.valid[at] != 0 &&
              expected[at] > 0.01F * peak) {
            errors[c].Add(static_cast<double>(slice.rd[at]),
                          static_cast<double>(slice.sigma[at]),
                          static_cast<double>(expected[at]));
          }
        }
      }
    }
  }
  return errors;
}

TEST(Mosaic, TheWholeLineAgreesWithTheTruth) {
  const TempFolder folder;
  WriteRig(folder);
  rigs::SimulatedRig rig(folder / "rig.toml", {.seed = 20263});
  const acquire::Devices devices{rig.camera(), rig.illuminator(), rig.stage()};
  auto writer = acquire::SessionWriter::Create(
      folder / "s",
      acquire::MakeManifest(
          rig.description(), rig.camera().Info(), rig.illuminator().Info()),
      false);
  EXPECT_EQ(rig.camera().Info().mosaic, "RGGB");
  acquire::CaptureCalibration(writer, devices);
  const calibrate::Calibration calibration =
      calibrate::Calibrate(acquire::SessionReader(folder / "s"), {});
  EXPECT_LE(calibration.reprojection_rms_px, 0.1);
  EXPECT_LE(calibration.laser_map_held_out_rms_mm, 0.02 * 1.96875);
  const calibrate::ColourFilters& filters = calibration.corrections.filters;
  ASSERT_EQ(filters.lasers.size(), 3U);
  EXPECT_NEAR(filters.lasers[0][1], 0.04 / 0.95, 0.005);
  EXPECT_NEAR(filters.lasers[2][1], 0.08 / 0.9, 0.005);
  EXPECT_NEAR(filters.white[0], 0.5 / 0.95, 0.005);
  const double seen[] = {6.5 * 10 * 0.95, 7.0 * 8 * 0.9, 5.5 * 8 * 0.9};
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_NEAR(calibration.channels[c].flux_scale_counts_mm2_sr_per_us / (seen[c] / 6),
                1,
                0.01);
  }
  acquire::CaptureGrid(writer, devices, calibration.scan_map);
  const acquire::SessionReader session(folder / "s");
  const ReconstructSummary summary =
      Reconstruct(session, calibration, folder / "x.rd.exr", {});
  EXPECT_THAT(summary.warnings, ::testing::Contains(::testing::HasSubstr("gloss: ")));
  const std::shared_ptr<const rigs::Transport> truth = rigs::MakeTransport(
      rigs::ReadPhantom(folder / "chessboard4x4-quick.toml"), rigs::Solver::kFast);
  for (const Errors& errors : Compare(folder / "x.rd.exr", *truth)) {
    EXPECT_GT(errors.count, 300);
    EXPECT_LT(errors.Rms(), 0.02);
    EXPECT_LT(std::abs(errors.Bias()), 0.005);
    EXPECT_NEAR(errors.within / errors.count, 0.68, 0.12);
    // Of which gloss was a fifth.
    EXPECT_NEAR(errors.lit / errors.lit_truth, 1, 0.03);
  }
  calibrate::Calibration grey = calibration;
  grey.corrections.filters = {};
  EXPECT_THAT(
      ErrorMessage([&] { Reconstruct(session, grey, folder / "y.rd.exr", {}); }),
      ::testing::HasSubstr("its pictures' colours are 'RGGB'"));
}

}  // namespace
}  // namespace nacre::reconstruct
