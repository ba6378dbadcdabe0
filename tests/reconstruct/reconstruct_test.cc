// The simulated rig's pictures to R_d, against the phantom's truth.

#include "reconstruct/reconstruct.h"

#include "reconstruct/error_figures.h"
#include "reconstruct/rd_dataset.h"
#include "tests/reconstruct/striped_session.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

namespace nacre::reconstruct {
namespace {

using ReconstructTest = StripedSession;

TEST_F(ReconstructTest, AgreesWithTheTruth) {
  const ReconstructSummary summary =
      Reconstruct(Session(), shared->calibration, Path("x.rd.exr"), {});
  EXPECT_EQ(summary.slice_count, 120);
  EXPECT_EQ(summary.saturated_count, 0);
  EXPECT_EQ(summary.invalid_count, 0);
  EXPECT_NEAR(summary.spot_sigma_mm, 0.12, 0.01);  // the rig's default
  const SliceSource measured = DatasetSource(Path("x.rd.exr"));
  EXPECT_EQ(measured.header.eta, 1.4);
  EXPECT_EQ(measured.header.channels, (std::vector<std::string>{"R", "IR"}));
  const SliceSource truth{measured.header, [&](int i, int j) {
                            return shared->truth(measured.header, i, j);
                          }};
  const ErrorFigures figures = CompareSlices(truth, measured);
  // Photon noise alone is about 0.4 % in the middle cell, of which L2 mostly consists,
  // and 0.2 % in a slice's total.
  EXPECT_LT(figures.relative_l2, 0.012);
  EXPECT_LT(figures.worst_total, 0.012);
  EXPECT_NEAR(figures.energy_ratio, 1, 0.004);
}

// Against a second session that differs in its noise alone: what the model gets wrong
// is in both, and isn't what sigma states.
TEST_F(ReconstructTest, SigmaIsTheNoise) {
  CaptureStripes(shared->folder.path(), "again", kSeed + 1);
  ReconstructOptions plain;
  plain.sharpen_spot = false;  // its width is measured anew in every session
  plain.subtract_crosstalk = false;
  plain.state_systematics = false;
  Reconstruct(Session(), shared->calibration, Path("first.rd.exr"), plain);
  Reconstruct(acquire::SessionReader(Path("again")),
              shared->calibration,
              Path("second.rd.exr"),
              plain);
  const RdDataset first = ReadDataset(Path("first.rd.exr"));
  const RdDataset second = ReadDataset(Path("second.rd.exr"));
  double squares = 0;
  for (std::size_t k = 0; k < first.rd.size(); ++k) {
    ASSERT_GT(first.sigma[k], 0.0F);
    squares += std::pow(static_cast<double>(first.rd[k] - second.rd[k]), 2) /
               (std::pow(static_cast<double>(first.sigma[k]), 2) +
                std::pow(static_cast<double>(second.sigma[k]), 2));
  }
  const auto count = static_cast<double>(first.rd.size());
  EXPECT_NEAR(std::sqrt(squares / count), 1, 0.05);
}

// Signed error at the rim of windows, which is where the neighbours' light is; noise
// averages out there, so that what stays is the light.
double RimError(const RdDataset& measured,
                const std::function<RdSlice(const RdHeader&, int, int)>& truth) {
  const RdHeader& header = measured.header;
  double sum = 0;
  for (int s = 0; s < header.PointCount(); ++s) {
    const RdSlice slice = truth(header, s % header.points_x, s / header.points_x);
    for (std::int64_t k = 0; k < header.SliceSize(); ++k) {
      const int cell = static_cast<int>(k % header.WindowSize());
      const int u = cell % header.core;
      const int v = cell / header.core;
      if (u == 0 || v == 0 || u + 1 == header.core || v + 1 == header.core) {
        sum += static_cast<double>(
            measured.rd[static_cast<std::size_t>(s * header.SliceSize() + k)] -
            slice.rd[static_cast<std::size_t>(k)]);
      }
    }
  }
  return sum;
}

TEST_F(ReconstructTest, CrosstalkIsTakenAway) {
  ReconstructOptions off;
  off.subtract_crosstalk = false;
  const ReconstructSummary plain =
      Reconstruct(Session(), shared->calibration, Path("plain.rd.exr"), off);
  const ReconstructSummary clean =
      Reconstruct(Session(), shared->calibration, Path("clean.rd.exr"), {});
  EXPECT_EQ(plain.max_crosstalk, 0);
  EXPECT_GT(clean.max_crosstalk, 0.001);
  const double with = RimError(ReadDataset(Path("plain.rd.exr")), shared->truth);
  const double without = RimError(ReadDataset(Path("clean.rd.exr")), shared->truth);
  EXPECT_GT(with, 0);
  EXPECT_LT(std::abs(without), 0.2 * with);

  const auto log_error = [&](const std::filesystem::path& path) {
    const SliceSource measured = DatasetSource(path);
    const SliceSource truth{measured.header, [&](int i, int j) {
                              return shared->truth(measured.header, i, j);
                            }};
    return CompareSlices(truth, measured).log_rms;
  };
  EXPECT_LT(log_error(Path("clean.rd.exr")), log_error(Path("plain.rd.exr")));
}

TEST_F(ReconstructTest, TheLitCellIsFilledFromOutsideAndSaysSo) {
  ReconstructOptions options;
  options.specular_radius_cells = 1;
  const ReconstructSummary summary =
      Reconstruct(Session(), shared->calibration, Path("f.rd.exr"), options);
  EXPECT_EQ(summary.invalid_count, 5 * 2 * summary.slice_count);
  Reconstruct(Session(), shared->calibration, Path("p.rd.exr"), {});
  RdReader filled(Path("f.rd.exr"));
  RdReader plain(Path("p.rd.exr"));
  const RdSlice a = filled.ReadSlice(5, 5);
  const RdSlice b = plain.ReadSlice(5, 5);
  constexpr std::size_t kCentre = 40;
  EXPECT_EQ(a.valid[kCentre], 0);
  EXPECT_EQ(a.valid[kCentre + 9], 0);
  EXPECT_GT(a.rd[kCentre], a.rd[kCentre + 1]);
  EXPECT_GT(a.rd[kCentre + 1], b.rd[kCentre + 2]);
  EXPECT_EQ(a.rd[kCentre + 2], b.rd[kCentre + 2]);
}

TEST_F(ReconstructTest, AveragingBothWaysSaysWhatItChanges) {
  ReconstructOptions options;
  options.symmetrize = true;
  options.state_systematics = false;
  const ReconstructSummary summary =
      Reconstruct(Session(), shared->calibration, Path("s.rd.exr"), options);
  EXPECT_GT(summary.symmetrize_change, 0);
  EXPECT_LT(summary.symmetrize_change, 0.02);
  RdReader reader(Path("s.rd.exr"));
  EXPECT_LT(MeasureReciprocity(reader).difference, 1e-5);
  const ReconstructSummary plain =
      Reconstruct(Session(), shared->calibration, Path("p.rd.exr"), {});
  EXPECT_EQ(plain.symmetrize_change, 0);
  EXPECT_GT(plain.reciprocity.difference, 1e-3);
  EXPECT_LT(plain.reciprocity.asymmetry, 0.1);
}

}  // namespace
}  // namespace nacre::reconstruct
