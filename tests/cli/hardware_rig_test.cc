// The command drives a rig of kind "hardware", camera and laser emulated, as a process
// of its own; a person, emulated too, answers what it asks.

#include "acquire/session.h"
#include "core/atomic_file.h"
#include "reconstruct/rd_dataset.h"
#include "rigs/emulated_rig.h"
#include "tests/cli/command.h"
#include "tests/support/temp_folder.h"

#include <gmock/gmock.h>

#include <array>
#include <csignal>
#include <cstring>
#include <fcntl.h>
#include <fmt/format.h>
#include <functional>
#include <optional>
#include <poll.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

namespace nacre::testing {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

constexpr const char* kPhantom = R"(
[slab]
thickness_mm = 6
eta = 1.38
[[medium]]
sigma_a_per_mm = [0.02, 0.03, 0.04]
sigma_s_per_mm = 2
)";

constexpr const char* kDevice = R"([camera.device]
id = "127.0.0.1"
reconnect_s = 20

[illuminator.device]
settle_us = 300
max_angle_deg = 17
power = [0.5, 0.6, 0.7]
reconnect_s = 20

[safety]
field_x_deg = [-5, 5]
field_y_deg = [-5, 5]
max_power = 0.7
max_dwell_us = 600
max_duty = 0.05
max_lit_s = 60

[targets])";

// rigs/simulated-stripes.toml behind devices, smaller, its light and its sensitivity
// such that exposures are whole cycles of the beam.
std::string RigText() {
  std::string text =
      ReadFile(std::filesystem::path(NACRE_RIGS_FOLDER) / "simulated-stripes.toml");
  const std::array<std::pair<std::string, std::string>, 9> edits{{
      {"kind = \"simulated\"", "kind = \"hardware\""},
      {"points = [20, 26]", "points = [4, 3]"},
      {"[30000, 6000, 1200]", "[800000, 80000]"},
      {"dark_frames = 8", "dark_frames = 2"},
      {"reference_exposure_us = 100", "reference_exposure_us = 20000"},
      {"laser_lattice = 7", "laser_lattice = 5"},
      {"[7.5, 8.0, 7.0]", "[0.0375, 0.04, 0.035]"},
      {"stripes.toml", "phantom.toml"},
      {"spot_sigma_mm = 0.15", "spot_sigma_mm = 0.15\ndac = true"},
  }};
  for (const auto& [from, to] : edits) {
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
  }
  return text.replace(text.find("[targets]"), std::strlen("[targets]"), kDevice);
}

// The command, its standard input and its standard error.
class Process {
 public:
  explicit Process(std::vector<std::string> arguments) {
    std::array<int, 2> pair{};
    EXPECT_EQ(socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair.data()), 0);
    socket_ = pair[0];
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, pair[1], 0);
    posix_spawn_file_actions_adddup2(&actions, pair[1], 2);
    posix_spawn_file_actions_addopen(&actions, 1, "/dev/null", O_WRONLY, 0);
    posix_spawn_file_actions_addclosefrom_np(&actions, 3);
    arguments.insert(arguments.begin(), NACRE_COMMAND);
    std::vector<char*> argv;
    for (std::string& argument : arguments) {
      argv.push_back(argument.data());
    }
    argv.push_back(nullptr);
    EXPECT_EQ(posix_spawn(&pid_, argv.front(), &actions, nullptr, argv.data(), environ),
              0);
    posix_spawn_file_actions_destroy(&actions);
    close(pair[1]);
  }
  ~Process() { close(socket_); }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  // The next line that it says; none once it ended or nothing comes for long.
  std::optional<std::string> Line() {
    for (;;) {
      const std::size_t end = said_.find('\n');
      if (end != std::string::npos) {
        const std::string line = said_.substr(0, end);
        said_.erase(0, end + 1);
        all_ += line + '\n';
        return line;
      }
      pollfd ready{socket_, POLLIN, 0};
      std::array<char, 512> part{};
      if (poll(&ready, 1, 60'000) != 1) {
        kill(pid_, SIGKILL);
        return std::nullopt;
      }
      const ssize_t count = read(socket_, part.data(), part.size());
      if (count <= 0) {
        return std::nullopt;
      }
      said_.append(part.data(), static_cast<std::size_t>(count));
    }
  }
  void PressEnter() const { EXPECT_EQ(write(socket_, "\n", 1), 1); }
  void CloseInput() const { shutdown(socket_, SHUT_WR); }
  void Signal(int signal) const { kill(pid_, signal); }
  const std::string& all() const { return all_; }

  // Its exit code, -1 if a signal ended it.
  int Wait() {
    while (Line()) {
    }
    int status = 0;
    waitpid(pid_, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

 private:
  pid_t pid_ = -1;
  int socket_ = -1;
  std::string said_;  // and not yet handed out
  std::string all_;
};

class HardwareRigTest : public ::testing::Test {
 protected:
  HardwareRigTest() {
    WriteFile(folder_ / "phantom.toml", kPhantom);
    std::string text = RigText();
    WriteFile(rig_toml(), text);
    rig_ = std::make_unique<rigs::EmulatedRig>(rig_toml());
    const std::string nobody = "127.0.0.1";
    text.replace(text.find(nobody), nobody.size(), rig_->camera().address());
    WriteFile(rig_toml(), text);
  }

  std::string rig_toml() const { return folder_ / "rig.toml"; }

  std::vector<std::string> CaptureArguments() const {
    return {"capture", rig_toml(), "--out", folder_ / "hardware", "--quiet"};
  }

  // Puts in place what a line asks for: "place: checkerboard 3: …, then press Enter".
  bool Place(const std::string& line) {
    using acquire::Target;
    for (const Target target : {Target::kNothing,
                                Target::kCheckerboard,
                                Target::kFlat,
                                Target::kReference,
                                Target::kGlare,
                                Target::kAmbient,
                                Target::kSample}) {
      const std::string start = fmt::format("place: {} ", acquire::Name(target));
      if (line.starts_with(start)) {
        EXPECT_THAT(line, HasSubstr("press Enter"));
        EXPECT_EQ(rig_->dac().Emitting(), nullptr) << "lit while a hand is in the rig";
        rig_->Place(target, std::stoi(line.substr(start.size())));
        return true;
      }
    }
    return false;
  }

  // The exit code of a command whose every question is answered.
  int Serve(Process& process) {
    while (const auto line = process.Line()) {
      if (Place(*line)) {
        ++placed_;
        process.PressEnter();
      }
    }
    return process.Wait();
  }

  reconstruct::RdDataset Dataset(const std::string& session) {
    const std::string calibration = folder_ / (session + ".json");
    const std::string dataset = folder_ / (session + ".rd.exr");
    RunJson({"calibrate", folder_ / session, "--out", calibration});
    RunJson({"reconstruct",
             folder_ / session,
             "--calibration",
             calibration,
             "--out",
             dataset});
    return reconstruct::ReadDataset(dataset);
  }

  TempFolder folder_;
  std::unique_ptr<rigs::EmulatedRig> rig_;
  int placed_ = 0;
};

template <class Value>
bool SameBytes(const std::vector<Value>& a, const std::vector<Value>& b) {
  return a.size() == b.size() &&
         std::memcmp(a.data(), b.data(), a.size() * sizeof(Value)) == 0;
}

TEST_F(HardwareRigTest, TheCommandMakesTheDatasetOfTheSimulatedRig) {
  std::vector<std::string> arguments = CaptureArguments();
  arguments.emplace_back("--arm-laser");
  Process capture(arguments);
  ASSERT_EQ(Serve(capture), 0) << capture.all();
  EXPECT_EQ(placed_, 1 + 11 + 1 + 1 + 1) << capture.all();
  EXPECT_FALSE(rig_->dac().IsShutterOpen());
  EXPECT_EQ(rig_->uneven_pictures(), 0);

  RunJson({"capture", rig_toml(), "--dry-run", "--out", folder_ / "simulated"});
  const acquire::SessionReader session(folder_ / "hardware");
  EXPECT_EQ(session.manifest().illuminator.model, "Helios laser DAC");
  const reconstruct::RdDataset dataset = Dataset("hardware");
  const reconstruct::RdDataset expected = Dataset("simulated");
  EXPECT_TRUE(SameBytes(dataset.rd, expected.rd));
  EXPECT_TRUE(SameBytes(dataset.sigma, expected.sigma));
  EXPECT_TRUE(SameBytes(dataset.valid, expected.valid));
  double brightest = 0;
  for (const float rd : dataset.rd) {
    brightest = std::max(brightest, static_cast<double>(rd));
  }
  EXPECT_GT(brightest, 0.01) << "mm^-2 below the beam";
}

TEST_F(HardwareRigTest, WithoutArmLaserItIsRefusedBeforeAnyDeviceIsTouched) {
  Process capture(CaptureArguments());
  EXPECT_EQ(Serve(capture), 2);
  EXPECT_THAT(capture.all(), HasSubstr("--arm-laser"));
  EXPECT_THAT(capture.all(), HasSubstr("goggles"));
  EXPECT_EQ(placed_, 0);
  EXPECT_EQ(rig_->camera().frames_sent(), 0);
  EXPECT_FALSE(rig_->dac().IsShutterOpen());
  EXPECT_FALSE(std::filesystem::exists(folder_ / "hardware"));
}

TEST_F(HardwareRigTest, WhoeverDoesntAnswerLeavesASessionThatGoesOn) {
  std::vector<std::string> arguments = CaptureArguments();
  arguments.emplace_back("--arm-laser");
  const auto ask_once = [&](const std::function<void(Process&)>& answer) {
    Process capture(arguments);
    const auto line = capture.Line();
    ASSERT_TRUE(line && line->starts_with("place: nothing 0")) << capture.all();
    answer(capture);
    EXPECT_EQ(capture.Wait(), 75) << capture.all();
    EXPECT_THAT(capture.all(), HasSubstr("--resume"));
    EXPECT_FALSE(rig_->dac().IsShutterOpen());
  };
  ask_once([](Process& capture) { capture.CloseInput(); });
  arguments.emplace_back("--resume");
  ask_once([](Process& capture) { capture.Signal(SIGINT); });
}

#ifdef NACRE_HAS_PROJECTOR
TEST_F(HardwareRigTest, AProjectorNeedsNoArming) {
  setenv("SDL_VIDEODRIVER", "dummy", 1);
  std::string text = ReadFile(rig_toml());
  const std::size_t at = text.find("[illuminator.device]");
  text.replace(at,
               text.find("[targets]") - at,
               "[illuminator.device]\nkind = \"projector\"\ndisplay = 0\n"
               "max_angle_deg = 17\nfield_x_deg = [-5, 5]\nfield_y_deg = [-5, 5]\n"
               "power = 1\nrefresh_hz = 50\n\n");
  WriteFile(rig_toml(), text);
  Process capture(CaptureArguments());
  const auto line = capture.Line();
  ASSERT_TRUE(line && line->starts_with("place: nothing 0")) << line.value_or("");
  capture.Signal(SIGINT);
  EXPECT_EQ(capture.Wait(), 75) << capture.all();
  const acquire::SessionManifest manifest = acquire::ReadManifest(folder_ / "hardware");
  EXPECT_EQ(manifest.illuminator.model, "video projector");
  EXPECT_FALSE(rig_->dac().IsShutterOpen());
}
#endif

}  // namespace
}  // namespace nacre::testing
