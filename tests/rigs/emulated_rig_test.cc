// Whole captures by the true drivers: a camera on the loopback interface, a laser DAC
// on an emulated USB, against the same rig in one process.

#include "rigs/emulated_rig.h"

#include "acquire/aravis_camera.h"
#include "acquire/capture.h"
#include "acquire/helios_illuminator.h"
#include "acquire/rig_light.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/random.h"
#include "tests/support/temp_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <cstdlib>
#include <fmt/format.h>
#include <numeric>
#include <poll.h>
#include <spawn.h>
#include <sstream>
#include <sys/socket.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

namespace nacre::testing {
namespace {

using namespace std::chrono_literals;
using rigs::CameraFault;
using rigs::EmulatedRig;
using rigs::MonotonicNs;

constexpr const char* kPhantom = R"(
[slab]
thickness_mm = 10
eta = 1.5
[[medium]]
sigma_a_per_mm = [0.02, 0.03, 0.04]
sigma_s_per_mm = 2
)";

constexpr const char* kRig = R"(
kind = "hardware"
[sample]
name = "test"
eta = 1.5
[grid]
points = [6, 4]
pitch_mm = 1.5
core = 3
[camera]
exposures_us = [40000, 20000]
dark_frames = 2
target_exposure_us = 5000
flat_exposures_us = [1000, 5000]
[camera.device]
id = "{}"
pixel_format = "Mono12p"
packet_size_bytes = 1400
reconnect_s = 20
[targets]
checkerboard_columns = 6
checkerboard_rows = 5
checkerboard_square_mm = 3
checkerboard_poses = 3
reference_reflectance = 0.99
reference_exposure_us = 20000
reference_frames = 1
laser_lattice = 5
[scanner]
mm_per_rad = 400
[schedule]
spot_spacing_cells = 3
[illuminator.device]
settle_us = 300
max_angle_deg = 17
power = [0.5, 0.6, 0.7]
reconnect_s = 20
[safety]
field_x_deg = [-2, 2]
field_y_deg = [-2, 2]
max_power = 0.7
max_dwell_us = 600
max_duty = 0.05
max_lit_s = 60
[simulated]
phantom = "phantom.toml"
seed = 4
[simulated.camera]
width_px = 64
height_px = 48
field_mm = 24
electrons_per_us_per_radiance = 0.5
[simulated.laser]
power_mw = [10, 8, 6]
dac = true
)";

acquire::ScanMap Map() {
  acquire::ScanMap map;
  map.x_rad[1] = map.y_rad[2] = 1.0 / 400;
  map.x_mm[1] = map.y_mm[2] = 400;
  return map;
}

acquire::SessionWriter OpenSession(const acquire::RigDescription& rig,
                                   const acquire::CameraInfo& camera,
                                   const acquire::IlluminatorInfo& laser,
                                   const std::filesystem::path& folder) {
  const auto manifest = acquire::MakeManifest(rig, camera, laser, std::nullopt);
  return std::filesystem::exists(folder / "session.json")
             ? acquire::SessionWriter::Resume(folder, manifest, false)
             : acquire::SessionWriter::Create(folder, manifest, false);
}

acquire::CaptureSummary TakeAll(acquire::SessionWriter& session,
                                const acquire::Devices& devices) {
  acquire::CaptureSummary all = acquire::CaptureCalibration(session, devices);
  const acquire::CaptureSummary grid = acquire::CaptureGrid(session, devices, Map());
  all.pictures_taken += grid.pictures_taken;
  all.frames_lost += grid.frames_lost;
  all.light_failures += grid.light_failures;
  return all;
}

// What lies in the rig is changed by telling whoever serves the rig, over a socket.
class RemoteStage final : public acquire::SampleStage {
 public:
  explicit RemoteStage(int socket) : socket_(socket) {}
  void Place(acquire::Target target, int pose) override {
    const std::array<int, 2> place{static_cast<int>(target), pose};
    char answer = 0;
    if (write(socket_, &place, sizeof place) != sizeof place ||
        read(socket_, &answer, 1) != 1) {
      throw DeviceError("nobody changes what lies in the rig");
    }
  }

 private:
  int socket_;
};

constexpr int kStageSocket = 3;  // of the child

// The program that drives the rig: run by the tests below as a process of its own.
TEST(EmulatedRigChild, DISABLED_Captures) {
  const char* folder = std::getenv("NACRE_TEST_FOLDER");
  ASSERT_NE(folder, nullptr);
  const acquire::RigDescription rig =
      acquire::ReadRig(std::filesystem::path(folder) / "rig.toml");
  acquire::AravisCamera camera(*rig.camera.device);
  RemoteStage stage(kStageSocket);
  acquire::HeliosIlluminator laser(rig.illuminator->device,
                                   rig.illuminator->safety,
                                   acquire::PlanSpots(rig),
                                   rig.scanner.channels);
  laser.Arm();
  acquire::SessionWriter session = OpenSession(
      rig, camera.Info(), laser.Info(), std::filesystem::path(folder) / "emulated");
  const acquire::CaptureSummary summary = TakeAll(session, {camera, laser, stage});
  WriteFile(std::filesystem::path(folder) / "summary",
            fmt::format("{} {} {}",
                        summary.frames_lost,
                        summary.light_failures,
                        camera.Statistics().reconnections));
}

class EmulatedRigTest : public ::testing::Test {
 protected:
  EmulatedRigTest() {
    WriteFile(folder_ / "phantom.toml", kPhantom);
    Write("127.0.0.1");
    rig_ = std::make_unique<EmulatedRig>(path());
    Write(rig_->camera().address());
    setenv("NACRE_TEST_FOLDER", folder_.path().c_str(), 1);
  }

  std::filesystem::path path() const { return folder_ / "rig.toml"; }

  void Write(const std::string& id) {
    std::string text = kRig;
    text.replace(text.find("{}"), 2, id);
    WriteFile(path(), text);
  }

  struct Child {
    pid_t pid = -1;
    int socket = -1;
  };

  static Child Start() {
    std::array<int, 2> pair{};
    EXPECT_EQ(socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair.data()), 0);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    // Two steps: a descriptor put in its own place would close at exec.
    posix_spawn_file_actions_adddup2(&actions, pair[1], 100);
    posix_spawn_file_actions_adddup2(&actions, 100, kStageSocket);
    posix_spawn_file_actions_addclosefrom_np(&actions, kStageSocket + 1);
    std::array<std::string, 3> texts{"/proc/self/exe",
                                     "--gtest_filter=EmulatedRigChild.*",
                                     "--gtest_also_run_disabled_tests"};
    std::array<char*, 4> argv{
        texts[0].data(), texts[1].data(), texts[2].data(), nullptr};
    Child child{.socket = pair[0]};
    EXPECT_EQ(posix_spawn(&child.pid, argv[0], &actions, nullptr, argv.data(), environ),
              0);
    posix_spawn_file_actions_destroy(&actions);
    close(pair[1]);
    return child;
  }

  // Serves the child's stage until it ends, or until `end_ns`: then false.
  bool Serve(const Child& child, std::int64_t end_ns) {
    while (MonotonicNs() < end_ns) {
      pollfd ready{child.socket, POLLIN, 0};
      if (poll(&ready, 1, 1) != 1) {
        continue;
      }
      std::array<int, 2> place{};
      if (read(child.socket, &place, sizeof place) != sizeof place) {
        return true;
      }
      rig_->Place(static_cast<acquire::Target>(place[0]), place[1]);
      (void)!write(child.socket, "", 1);
    }
    return false;
  }

  // Its exit status; -1 if it had to be killed.
  int Finish(const Child& child) {
    const std::int64_t end_ns = MonotonicNs() + 90'000'000'000;
    Serve(child, end_ns);
    int status = -1;
    while (waitpid(child.pid, &status, WNOHANG) == 0) {
      if (MonotonicNs() > end_ns) {
        kill(child.pid, SIGKILL);
      }
      std::this_thread::sleep_for(1ms);
    }
    close(child.socket);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

  // Frames and exposures of the emulated session are those of the one in one process.
  void ExpectSameSession() {
    if (!std::filesystem::exists(folder_ / "simulated")) {
      rigs::SimulatedRig simulated(path(), {.thread_count = 1});
      auto session = OpenSession(simulated.description(),
                                 simulated.camera().Info(),
                                 simulated.illuminator().Info(),
                                 folder_ / "simulated");
      TakeAll(session,
              {simulated.camera(), simulated.illuminator(), simulated.stage()});
    }
    const acquire::SessionReader expected(folder_ / "simulated");
    const acquire::SessionReader actual(folder_ / "emulated");
    ASSERT_EQ(actual.picture_count(), expected.picture_count());
    for (std::int64_t k = 0; k < expected.picture_count(); ++k) {
      const acquire::Frame frame = actual.ReadFrame(k);
      const acquire::Frame wanted = expected.ReadFrame(k);
      const auto sum = [](const acquire::Frame& f) {
        return std::accumulate(f.counts.begin(), f.counts.end(), std::int64_t{0});
      };
      ASSERT_TRUE(frame.counts == wanted.counts)
          << "picture " << k << ", counts of " << sum(frame) << " instead of "
          << sum(wanted);
      ASSERT_EQ(frame.exposure_us, expected.ReadFrame(k).exposure_us);
    }
    EXPECT_EQ(rig_->uneven_pictures(), 0);
    EXPECT_EQ(rig_->dac().counts().looping, 0);
    EXPECT_EQ(rig_->dac().counts().malformed, 0);
  }

  TempFolder folder_;
  std::unique_ptr<EmulatedRig> rig_;
};

TEST_F(EmulatedRigTest, ACaptureEqualsTheSimulatedOne) {
  EXPECT_EQ(Finish(Start()), 0);
  ExpectSameSession();
  EXPECT_FALSE(rig_->dac().IsShutterOpen());
}

TEST_F(EmulatedRigTest, FaultsChangeNoPicture) {
  RandomStream random(7, 0);
  std::vector<CameraFault> faults(1000, CameraFault::kNone);
  // A frame has 7 packets, of which 2 % are lost; not so many in a row that the capture
  // gives up, as it should.
  for (std::size_t k = 2; k < faults.size(); ++k) {
    if (random.Uniform() < 0.13 && faults[k - 2] == CameraFault::kNone) {
      faults[k] = CameraFault::kDropPacket;
    }
  }
  rig_->camera().Script(faults);
  std::jthread saboteur([this](const std::stop_token& stop) {
    const auto after = [&](std::int64_t pictures) {
      while (!stop.stop_requested() && rig_->camera().frames_sent() < pictures) {
        std::this_thread::sleep_for(1ms);
      }
    };
    after(20);
    rig_->dac().StallAfter(0);
    after(28);
    rig_->dac().HangAfter(0);
    after(34);
    rig_->dac().UnplugAfter(1, 50ms);
    after(42);
    rig_->camera().UnplugAtNextTrigger(200ms);
    after(50);
    rig_->dac().UnplugAfter(0, 150ms);
    after(60);
    rig_->camera().UnplugAtNextTrigger(200ms);
  });
  EXPECT_EQ(Finish(Start()), 0);
  saboteur.request_stop();
  saboteur.join();
  std::istringstream summary(ReadFile(folder_ / "summary", 1000));
  int frames_lost = 0;
  int light_failures = 0;
  int reconnections = 0;
  summary >> frames_lost >> light_failures >> reconnections;
  EXPECT_GE(frames_lost, 1);
  EXPECT_EQ(reconnections, 2);
  ExpectSameSession();
}

TEST_F(EmulatedRigTest, KillsLeaveASessionThatGoesOnAndNoLight) {
  const char* wanted = std::getenv("NACRE_KILLS");
  const int kills = wanted == nullptr ? 8 : std::atoi(wanted);
  RandomStream random(11, 0);
  std::int64_t longest_ns = 0;
  int in_the_light = 0;
  int completed = 0;
  for (int killed = 0; killed < kills;) {
    const auto life_ns = static_cast<std::int64_t>(1.2e9 * random.Uniform());
    const Child child = Start();
    if (Serve(child, MonotonicNs() + life_ns)) {
      EXPECT_EQ(Finish(child), 0);
      ExpectSameSession();
      std::filesystem::remove_all(folder_ / "emulated");
      ++completed;
      continue;
    }
    in_the_light += rig_->dac().Emitting() ? 1 : 0;
    const std::int64_t killed_ns = MonotonicNs();
    kill(child.pid, SIGKILL);
    waitpid(child.pid, nullptr, 0);
    close(child.socket);
    ++killed;
    rig_->camera().Plug();  // spares waiting for its heartbeat to time out
    for (int wait = 0; rig_->dac().IsShutterOpen() && wait < 2000; ++wait) {
      std::this_thread::sleep_for(1ms);
    }
    EXPECT_FALSE(rig_->dac().IsShutterOpen());
    const auto spans = rig_->dac().LitSpans();
    if (!spans.empty()) {
      longest_ns = std::max(longest_ns, spans.back().end_ns - killed_ns);
    }
  }
  EXPECT_LE(longest_ns, 50'000'000);
  EXPECT_EQ(Finish(Start()), 0);
  ExpectSameSession();
  RecordProperty("longest_light_us", static_cast<int>(longest_ns / 1000));
  RecordProperty("killed_in_the_light", in_the_light);
  RecordProperty("completed_between", completed);
}

}  // namespace
}  // namespace nacre::testing
