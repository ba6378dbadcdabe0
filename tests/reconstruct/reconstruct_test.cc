// The simulated rig's pictures to R_d, against the phantom's truth.

#include "reconstruct/reconstruct.h"

#include "acquire/capture.h"
#include "calibrate/calibrate.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "reconstruct/error_figures.h"
#include "reconstruct/rd_dataset.h"
#include "rigs/simulated_rig.h"
#include "rigs/transport/transport.h"
#include "tests/support/error_message.h"
#include "tests/support/temp_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <malloc.h>
#include <memory>

namespace nacre::reconstruct {
namespace {

using nacre::testing::ErrorMessage;
using ::testing::HasSubstr;

constexpr const char* kRig = R"(kind = "simulated"
[sample]
name = "stripes"
eta = 1.4
[grid]
points = [12, 10]
pitch_mm = 1.5
core = 9
[camera]
exposures_us = [40000, 4000, 400]
dark_frames = 2
target_exposure_us = 12000
flat_exposures_us = [3000, 12000]
[targets]
checkerboard_columns = 7
checkerboard_rows = 5
checkerboard_square_mm = 4.0
checkerboard_poses = 6
reference_reflectance = 0.99
reference_exposure_us = 40
reference_frames = 2
laser_lattice = 5
[scanner]
mm_per_rad = 400.0
channels = ["R", "IR"]
[schedule]
spot_spacing_cells = 10
order_seed = 4
[simulated]
phantom = "phantom.toml"
seed = 1
[simulated.camera]
width_px = 200
height_px = 200
field_mm = 40.0
electrons_per_us_per_radiance = [6.5, 6.0]
[simulated.laser]
power_mw = [10.0, 8.0]
[simulated.lamp]
electrons_per_us = 1.4
)";

constexpr const char* kPhantom = R"(channels = ["R", "IR"]
[slab]
thickness_mm = 12.0
eta = 1.4
bottom = "air"
[[medium]]
name = "clear"
sigma_a_per_mm = [0.01, 0.02]
sigma_s_per_mm = [1.4, 1.2]
g = 0.0
[[medium]]
name = "dense"
sigma_a_per_mm = [0.05, 0.03]
sigma_s_per_mm = [2.5, 2.2]
g = 0.0
[pattern]
type = "chessboard"
cell_mm = 5.0
[beam]
shape = "pencil"
[grid]
points = [12, 10]
pitch_mm = 1.5
core = 9
)";

constexpr std::uint64_t kSeed = 77;

void Capture(const std::filesystem::path& folder,
             const std::string& name,
             std::uint64_t seed) {
  rigs::SimulatedRig rig(folder / "rig.toml", {.seed = seed});
  const acquire::Devices devices{rig.camera(), rig.illuminator(), rig.stage()};
  auto writer = acquire::SessionWriter::Create(
      folder / name,
      acquire::MakeManifest(
          rig.description(), devices.camera.Info(), devices.illuminator.Info()),
      false);
  acquire::CaptureCalibration(writer, devices);
  const acquire::ScanMap map =
      calibrate::EstimateScanMap(acquire::SessionReader(folder / name), {});
  acquire::CaptureGrid(writer, devices, map);
}

// One capture and its calibration for all tests: it is most of the work.
class ReconstructTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    shared = std::make_unique<Shared>();
    const std::filesystem::path folder = shared->folder.path();
    WriteFile(folder / "rig.toml", kRig);
    WriteFile(folder / "phantom.toml", kPhantom);
    Capture(folder, "session", kSeed);
    shared->calibration =
        calibrate::Calibrate(acquire::SessionReader(folder / "session"), {});
    const std::shared_ptr<const rigs::Transport> transport = rigs::MakeTransport(
        rigs::ReadPhantom(folder / "phantom.toml"), rigs::Solver::kFast);
    shared->truth = [transport](const RdHeader& header, int i, int j) {
      const PointMm x_i = header.GridPoint(i, j);
      RdSlice slice = MakeSlice(header);
      slice.rd = transport->WindowAround({x_i.x, x_i.y}).rd;
      return slice;
    };
  }
  static void TearDownTestSuite() { shared.reset(); }

  static acquire::SessionReader Session() {
    return acquire::SessionReader(shared->folder / "session");
  }
  static std::filesystem::path Path(const std::string& name) {
    return shared->folder / name;
  }

  struct Shared {
    testing::TempFolder folder;
    calibrate::Calibration calibration;
    std::function<RdSlice(const RdHeader&, int, int)> truth;
  };
  static std::unique_ptr<Shared> shared;
};
std::unique_ptr<ReconstructTest::Shared> ReconstructTest::shared;

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
  Capture(shared->folder.path(), "again", kSeed + 1);
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
  EXPECT_LT(std::abs(without), 0.35 * with);

  const auto log_error = [&](const std::filesystem::path& path) {
    const SliceSource measured = DatasetSource(path);
    const SliceSource truth{measured.header, [&](int i, int j) {
                              return shared->truth(measured.header, i, j);
                            }};
    return CompareSlices(truth, measured).log_rms;
  };
  EXPECT_LT(log_error(Path("clean.rd.exr")), log_error(Path("plain.rd.exr")));
}

TEST_F(ReconstructTest, BytesDependOnNeitherThreadsNorMemory) {
  ReconstructOptions options;
  options.thread_count = 1;
  options.memory_bytes = 1;
  Reconstruct(Session(), shared->calibration, Path("one.rd.exr"), options);
  for (const int threads : {2, 3}) {
    options.thread_count = threads;
    options.memory_bytes = 1e9;
    Reconstruct(Session(), shared->calibration, Path("many.rd.exr"), options);
    EXPECT_TRUE(ReadFile(Path("many.rd.exr")) == ReadFile(Path("one.rd.exr")));
  }
}

// A number of kB from /proc/self/status.
std::size_t StatusKb(const std::string& key) {
  std::ifstream status("/proc/self/status");
  std::string line;
  while (std::getline(status, line)) {
    if (line.rfind(key + ":", 0) == 0) {
      return std::stoul(line.substr(key.size() + 1));
    }
  }
  return 0;
}

TEST_F(ReconstructTest, MemoryStaysUnderTheBoundOnASessionEightTimesLarger) {
  double session_bytes = 0;
  for (const auto& file :
       std::filesystem::directory_iterator(Path("session") / "frames")) {
    session_bytes += static_cast<double>(file.file_size());
  }
  ReconstructOptions options;
  options.memory_bytes = session_bytes / 8;
  options.thread_count = 2;
  const acquire::SessionReader session = Session();
  // Once before, for libraries' code and threads, which are not the session's.
  Reconstruct(session, shared->calibration, Path("m.rd.exr"), options);
  malloc_trim(0);
  std::ofstream("/proc/self/clear_refs") << "5";  // the peak begins anew
  const std::size_t before_kb = StatusKb("VmRSS");
  Reconstruct(session, shared->calibration, Path("m.rd.exr"), options);
  const std::size_t peak_kb = StatusKb("VmHWM");
  ASSERT_GT(before_kb, 0U);
  EXPECT_LT(1024.0 * static_cast<double>(peak_kb - before_kb), options.memory_bytes);
}

TEST_F(ReconstructTest, TheCalibrationMustBeOfTheSameRig) {
  calibrate::Calibration other = shared->calibration;
  other.session_rig_hash = "another";
  EXPECT_THAT(
      ErrorMessage([&] { Reconstruct(Session(), other, Path("y.rd.exr"), {}); }),
      HasSubstr("calibration is of rig another"));
  other = shared->calibration;
  other.camera.width_px = 7;
  EXPECT_THAT(
      ErrorMessage([&] { Reconstruct(Session(), other, Path("y.rd.exr"), {}); }),
      HasSubstr("200 x 200 pixels, the calibrated camera 7 x 200"));
  other = shared->calibration;
  other.channels.pop_back();
  EXPECT_THAT(
      ErrorMessage([&] { Reconstruct(Session(), other, Path("y.rd.exr"), {}); }),
      HasSubstr("2 laser channels, the calibration has 1"));
  EXPECT_FALSE(std::filesystem::exists(Path("y.rd.exr")));
}

TEST_F(ReconstructTest, MissingPicturesAreNamed) {
  const std::filesystem::path cut = Path("cut");
  std::filesystem::copy(Path("session"), cut, std::filesystem::copy_options::recursive);
  const std::string journal = ReadFile(cut / "journal");
  WriteFile(
      cut / "journal",
      std::string_view(journal).substr(0, journal.rfind('\n', journal.size() - 2) + 1));
  EXPECT_THAT(
      ErrorMessage([&] {
        Reconstruct(
            acquire::SessionReader(cut), shared->calibration, Path("y.rd.exr"), {});
      }),
      HasSubstr("--resume"));
}

// As long as nothing is lost and nothing read twice: first the pictures of some groups,
// then all, then the same again, against one run over all.
TEST_F(ReconstructTest, LaterRunsReadOnlyWhatIsNew) {
  const std::filesystem::path part = Path("part");
  std::filesystem::copy(
      Path("session"), part, std::filesystem::copy_options::recursive);
  const std::string journal = ReadFile(part / "journal");
  const acquire::SessionReader whole = Session();
  // 3 groups and a picture.
  const std::int64_t lines = whole.schedule().grid_begin() + 3 * 6 + 1;
  std::size_t end = 0;
  for (std::int64_t line = 0; line < lines; ++line) {
    end = journal.find('\n', end) + 1;
  }
  WriteFile(part / "journal", std::string_view(journal).substr(0, end));
  ReconstructOptions options;
  options.incremental = true;
  const std::filesystem::path out = Path("inc.rd.exr");
  ReconstructSummary summary =
      Reconstruct(acquire::SessionReader(part), shared->calibration, out, options);
  EXPECT_EQ(summary.frame_count, 18);
  EXPECT_EQ(summary.groups_missing, summary.group_count - 3);
  EXPECT_GT(summary.invalid_count, 0);

  WriteFile(part / "journal", journal);
  summary =
      Reconstruct(acquire::SessionReader(part), shared->calibration, out, options);
  EXPECT_EQ(summary.groups_reused, 3);
  EXPECT_EQ(summary.groups_missing, 0);
  EXPECT_EQ(summary.frame_count, 6 * (summary.group_count - 3));
  Reconstruct(
      acquire::SessionReader(part), shared->calibration, Path("one.rd.exr"), {});
  EXPECT_TRUE(ReadFile(out) == ReadFile(Path("one.rd.exr")));

  summary =
      Reconstruct(acquire::SessionReader(part), shared->calibration, out, options);
  EXPECT_EQ(summary.frame_count, 0);
  EXPECT_TRUE(ReadFile(out) == ReadFile(Path("one.rd.exr")));

  // A work file that was damaged, or of another calibration, costs time and no more.
  std::string work = ReadFile(Path("inc.rd.exr.work"));
  work[work.size() / 2] = static_cast<char>(work[work.size() / 2] ^ 1);
  WriteFile(Path("inc.rd.exr.work"), work);
  summary =
      Reconstruct(acquire::SessionReader(part), shared->calibration, out, options);
  EXPECT_EQ(summary.frame_count, 6);
  EXPECT_TRUE(ReadFile(out) == ReadFile(Path("one.rd.exr")));
  calibrate::Calibration other = shared->calibration;
  other.read_noise_electrons *= 1.01;
  summary = Reconstruct(acquire::SessionReader(part), other, out, options);
  EXPECT_EQ(summary.groups_reused, 0);
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

TEST_F(ReconstructTest, StoppingLeavesNothing) {
  EXPECT_THROW(Reconstruct(Session(),
                           shared->calibration,
                           Path("y.rd.exr"),
                           {},
                           [](const Progress& state) { return state.done < 2; }),
               Error);
  EXPECT_FALSE(std::filesystem::exists(Path("y.rd.exr")));
}

}  // namespace
}  // namespace nacre::reconstruct
