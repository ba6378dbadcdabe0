// A capture by the simulated rig, killed and resumed, against one that ran through.

#include "acquire/capture.h"
#include "calibrate/calibrate.h"
#include "core/atomic_file.h"
#include "core/random.h"
#include "rigs/simulated_rig.h"
#include "tests/support/temp_folder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <functional>
#include <map>
#include <set>
#include <sys/wait.h>
#include <unistd.h>

namespace nacre::calibrate {
namespace {

using testing::TempFolder;

constexpr const char* kFolderVariable = "NACRE_TEST_CAPTURE_FOLDER";

constexpr const char* kRig = R"(kind = "simulated"
[sample]
name = "small"
eta = 1.5
[grid]
points = [10, 8]
pitch_mm = 3.0
core = 5
[camera]
exposures_us = [40000, 4000]
dark_frames = 2
target_exposure_us = 12000
flat_exposures_us = [3000, 12000]
[targets]
checkerboard_columns = 7
checkerboard_rows = 5
checkerboard_square_mm = 6.0
checkerboard_poses = 4
reference_reflectance = 0.99
reference_exposure_us = 100
reference_frames = 1
laser_lattice = 5
[scanner]
mm_per_rad = 400.0
channels = ["R"]
[schedule]
order_seed = 3
[simulated]
phantom = "phantom.toml"
[simulated.camera]
width_px = 200
height_px = 200
field_mm = 64.0
electrons_per_us_per_radiance = [6.5]
[simulated.laser]
power_mw = [10.0]
[simulated.lamp]
electrons_per_us = 1.4
)";

constexpr const char* kPhantom = R"(channels = ["R"]
[slab]
thickness_mm = 10.0
eta = 1.5
bottom = "air"
[[medium]]
name = "marble"
sigma_a_per_mm = [0.02]
sigma_s_per_mm = [2.0]
g = 0.0
[pattern]
type = "homogeneous"
[beam]
shape = "pencil"
[grid]
points = [10, 8]
pitch_mm = 3.0
core = 5
)";

// What nacre capture does, resuming if there is something to resume.
void CaptureAll(const std::filesystem::path& folder) {
  rigs::SimulatedRig rig(folder / "rig.toml", {.seed = 5, .thread_count = 1});
  const acquire::Devices devices{rig.camera(), rig.illuminator(), rig.stage()};
  const acquire::SessionManifest manifest = acquire::MakeManifest(
      rig.description(), devices.camera.Info(), devices.illuminator.Info(), 5);
  const std::filesystem::path out = folder / "session";
  acquire::SessionWriter session =
      std::filesystem::exists(out / "session.json")
          ? acquire::SessionWriter::Resume(out, manifest, false)
          : acquire::SessionWriter::Create(out, manifest, false);
  acquire::CaptureCalibration(session, devices);
  const acquire::ScanMap map =
      session.manifest().scan_map
          ? *session.manifest().scan_map
          : EstimateScanMap(acquire::SessionReader(out), CalibrateOptions());
  acquire::CaptureGrid(session, devices, map);
}

void WriteRig(const std::filesystem::path& folder) {
  WriteFile(folder / "rig.toml", kRig);
  WriteFile(folder / "phantom.toml", kPhantom);
}

std::map<std::string, std::string> Contents(const std::filesystem::path& folder) {
  std::map<std::string, std::string> contents;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file() && entry.path().filename() != "lock") {
      contents[std::filesystem::relative(entry.path(), folder).string()] =
          ReadFile(entry.path());
    }
  }
  return contents;
}

// Starts this program again as a process that captures into `folder`: a plain fork
// would inherit the thread pools' locks without their threads.
pid_t StartCapture(const std::filesystem::path& folder) {
  const pid_t child = ::fork();
  if (child == 0) {
    ::setenv(kFolderVariable, folder.c_str(), 1);
    ::execl("/proc/self/exe",
            "calibrate_tests",
            "--gtest_filter=CaptureProcess.Run",
            "--gtest_brief=1",
            nullptr);
    ::_exit(127);
  }
  return child;
}

// Lines of the journal.
std::int64_t PictureCount(const std::filesystem::path& folder) {
  const std::filesystem::path path = folder / "session" / "journal";
  if (!std::filesystem::exists(path)) {
    return 0;
  }
  const std::string text = ReadFile(path);
  return std::count(text.begin(), text.end(), '\n');
}

// Kills the process once `is_time`, unless it ends before; how it ended, as of waitpid.
int KillAt(pid_t child, const std::function<bool()>& is_time) {
  int status = 0;
  while (!is_time()) {
    if (::waitpid(child, &status, WNOHANG) != 0) {
      return status;
    }
    ::usleep(200);
  }
  ::kill(child, SIGKILL);
  ::waitpid(child, &status, 0);
  return status;
}

// Not a test by itself: the body of the processes that get killed below.
TEST(CaptureProcess, Run) {
  const char* folder = std::getenv(kFolderVariable);
  if (folder == nullptr) {
    GTEST_SKIP() << "is run by SimulatedCapture";
  }
  CaptureAll(folder);
}

TEST(SimulatedCapture, KilledAtTenRandomInstantsIsTheSameBitForBit) {
  const TempFolder whole;
  WriteRig(whole.path());
  CaptureAll(whole.path());

  const auto expected = Contents(whole / "session");

  const TempFolder folder;
  WriteRig(folder.path());
  constexpr std::uint64_t kSeed = 2;
  constexpr int kKills = 10;
  constexpr int kStartsAtMost = 60;
  RandomStream random(kSeed, 0);
  std::set<std::int64_t> reached;  // pictures that were there after each kill
  int kills = 0;
  for (int start = 0; start < kStartsAtMost && kills < kKills; ++start) {
    const std::int64_t wanted =
        PictureCount(folder.path()) + static_cast<std::int64_t>(12 * random.Uniform());
    const auto delay_us = static_cast<useconds_t>(30e3 * random.Uniform());
    const int status = KillAt(StartCapture(folder.path()), [&] {
      if (PictureCount(folder.path()) < wanted) {
        return false;
      }
      ::usleep(delay_us);
      return true;
    });
    if (WIFSIGNALED(status)) {
      ++kills;
      reached.insert(PictureCount(folder.path()));
    } else {  // it came to its end first: that one is done, and the next begins anew
      ASSERT_EQ(WEXITSTATUS(status), 0);
      ASSERT_TRUE(Contents(folder / "session") == expected);
      std::filesystem::remove_all(folder / "session");
    }
  }
  EXPECT_EQ(kills, kKills);
  EXPECT_GE(reached.size(), 5U) << "too few kills hit the capture to show anything";
  CaptureAll(folder.path());
  const acquire::SessionReader session(folder / "session");
  EXPECT_TRUE(session.IsComplete());
  constexpr int kOtherFiles = 2;  // session.json and journal
  EXPECT_EQ(std::ssize(expected), session.picture_count() + kOtherFiles);
  EXPECT_TRUE(Contents(folder / "session") == expected);
  const Calibration calibration = Calibrate(session, CalibrateOptions());
  EXPECT_LT(calibration.reprojection_rms_px, 0.1);
  // kΦ in counts: 6.5 electrons/µs per mW mm⁻² sr⁻¹ × 10 mW / 6 electrons a count.
  EXPECT_NEAR(
      calibration.channels[0].flux_scale_counts_mm2_sr_per_us, 65.0 / 6, 0.01 * 65 / 6);
}

}  // namespace
}  // namespace nacre::calibrate
