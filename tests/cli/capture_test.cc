// The verb `capture`, on a simulated rig small enough to be captured often.

#include "cli/capture.h"

#include "acquire/session.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "tests/cli/command.h"
#include "tests/support/temp_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <fcntl.h>
#include <filesystem>
#include <fmt/format.h>
#include <httplib.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

namespace nacre::cli {
namespace {

using nacre::testing::RunJson;
using nacre::testing::TempFolder;
using ::testing::HasSubstr;

using Edits = std::vector<std::pair<std::string, std::string>>;

// rigs/simulated-stripes.toml with three by four points, in `folder`.
std::filesystem::path Rig(const TempFolder& folder, Edits edits = {}) {
  const std::filesystem::path rigs = NACRE_RIGS_FOLDER;
  std::string text = ReadFile(rigs / "simulated-stripes.toml");
  edits.insert(edits.begin(),
               {{"points = [20, 26]", "points = [4, 3]"},
                {"dark_frames = 8", "dark_frames = 2"},
                {"phantom = \"stripes.toml\"",
                 "phantom = \"" + (rigs / "stripes.toml").string() + "\""}});
  for (const auto& [from, to] : edits) {
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
  }
  const std::filesystem::path path = folder / "rig.toml";
  WriteFile(path, text);
  return path;
}

const Edits kHardware = {{"kind = \"simulated\"", "kind = \"hardware\""},
                         {"[targets]",
                          "[camera.device]\nid = \"no such camera\"\nregion = [0, 0, "
                          "300, 330]\n\n[targets]"}};

TEST(CaptureVerb, PlansAHardwareRigWithoutDevices) {
  const TempFolder folder;
  const Json plan = RunJson({"capture", Rig(folder, kHardware), "--plan"});
  EXPECT_EQ(plan.at("grid_points"), 12);
  EXPECT_EQ(plan.at("grid_pictures"), 12 * 3 * 3);
  EXPECT_GE(plan.at("disk_bytes").get<double>(),
            plan.at("pictures").get<double>() * 300 * 330 * 2);
  Edits edits = kHardware;
  edits.push_back({"region = [0, 0, 300, 330]\n", ""});
  edits.push_back(
      {"core = 13", "core = 13\noutline_mm = [-1, -9, 1, -9, 1, 9, -1, 9]"});
  edits.push_back({"[schedule]", "[adaptive]\n\n[schedule]"});
  const Json unknown = RunJson({"capture", Rig(folder, edits), "--plan"});
  EXPECT_TRUE(unknown.at("disk_bytes").is_null());
  EXPECT_TRUE(unknown.at("adaptive").get<bool>());
  EXPECT_EQ(unknown.at("grid_points"), 6) << "two columns lie inside the outline";
}

TEST(CaptureVerb, DryRunsAHardwareRigToTheSimulatedOnesBits) {
  const TempFolder folder;
  const TempFolder other;
  RunJson({"capture", Rig(folder), "--out", folder / "s"});
  RunJson({"capture", Rig(other, kHardware), "--dry-run", "--out", other / "s"});
  const acquire::SessionReader simulated(folder / "s");
  const acquire::SessionReader dry(other / "s");
  ASSERT_TRUE(dry.IsComplete());
  ASSERT_EQ(dry.picture_count(), simulated.picture_count());
  for (std::int64_t k = 0; k < dry.picture_count(); ++k) {
    EXPECT_EQ(dry.Entry(k).hash, simulated.Entry(k).hash) << k;
  }
}

TEST(CaptureVerb, AnAdaptiveCaptureLeavesOutWhatReconstructionDoesntMiss) {
  const TempFolder full;
  const TempFolder adaptive;
  const auto dataset = [](const TempFolder& folder) {
    RunJson({"calibrate", folder / "s", "--out", folder / "c.json"});
    RunJson({"reconstruct",
             folder / "s",
             "--calibration",
             folder / "c.json",
             "--out",
             folder / "x.rd.exr"});
  };
  // 1.2 ms overexpose nothing here: 0.24 ms say little more.
  const std::pair<std::string, std::string> ladder{"exposures_us = [30000, 6000, 1200]",
                                                   "exposures_us = [30000, 1200, 240]"};
  RunJson({"capture", Rig(full, {ladder}), "--out", full / "s"});
  const Json summary =
      RunJson({"capture",
               Rig(adaptive, {ladder, {"[schedule]", "[adaptive]\n\n[schedule]"}}),
               "--out",
               adaptive / "s"});
  EXPECT_GT(summary.at("pictures_left_out"), 10);
  EXPECT_EQ(summary.at("pictures_taken").get<int>() +
                summary.at("pictures_left_out").get<int>(),
            summary.at("pictures").get<int>());
  const Json inspected = RunJson({"inspect", adaptive / "s"});
  EXPECT_EQ(inspected.at("pictures_left_out"), summary.at("pictures_left_out"));
  dataset(full);
  dataset(adaptive);
  const Json error = RunJson({"compare", adaptive / "x.rd.exr", full / "x.rd.exr"});
  EXPECT_LE(error.at("relative_l2").get<double>(), 0.005);
  EXPECT_LE(error.at("worst_total").get<double>(), 0.005);
}

TEST(CaptureVerb, PointsOutsideOfTheOutlineAreInvalidInTheDataset) {
  const TempFolder folder;
  RunJson({"capture",
           Rig(folder,
               {{"core = 13", "core = 13\noutline_mm = [-1, -9, 1, -9, 1, 9, -1, 9]"}}),
           "--out",
           folder / "s"});
  RunJson({"calibrate", folder / "s", "--out", folder / "c.json"});
  const Json summary = RunJson({"reconstruct",
                                folder / "s",
                                "--calibration",
                                folder / "c.json",
                                "--out",
                                folder / "x.rd.exr"});
  EXPECT_GE(summary.at("invalid_values").get<int>(), 6 * 13 * 13 * 3);
}

TEST(CaptureVerb, ThePreviewShowsTheCaptureUnderWay) {
  const TempFolder folder;
  CaptureRequest request;
  request.rig = Rig(folder);
  request.out = folder / "s";
  std::string url;
  request.on_preview = [&url](const std::string& given) { url = given; };
  std::int64_t seen = 0;
  const auto progress = [&](const Progress& state) {
    if (state.stage == "capture" && state.done % 40 == 0) {
      const std::size_t colon = url.find(':', 6);
      const std::size_t slash = url.find('/', colon);
      httplib::Client client("127.0.0.1", std::stoi(url.substr(colon + 1)));
      const auto answer = client.Get(url.substr(slash) + "state.json");
      const Json json = ParseJson(answer->body, url);
      EXPECT_EQ(json.at("done"), state.done);
      EXPECT_EQ(json.at("sample"), "stripes");
      EXPECT_GT(json.at("faults").at("frames"), 0);
      ++seen;
    }
    return true;
  };
  RunCapture(request, progress);
  EXPECT_GT(seen, 0);
}

// The command as a process of its own, so that it may be sent signals.
class Process {
 public:
  explicit Process(const std::vector<std::string>& arguments) : pid_(::fork()) {
    if (pid_ != 0) {
      return;
    }
    const int nowhere = ::open("/dev/null", O_WRONLY);
    ::dup2(nowhere, 1);
    ::dup2(nowhere, 2);
    std::vector<char*> argv{const_cast<char*>(NACRE_COMMAND)};
    for (const std::string& argument : arguments) {
      argv.push_back(const_cast<char*>(argument.c_str()));
    }
    argv.push_back(nullptr);
    ::execv(NACRE_COMMAND, argv.data());
    ::_exit(127);
  }
  void Signal(int signal) const { ::kill(pid_, signal); }
  // As of waitpid(2).
  int Wait() const {
    int status = 0;
    ::waitpid(pid_, &status, 0);
    return status;
  }

 private:
  pid_t pid_;
};

void AwaitPictures(const std::filesystem::path& session, int count) {
  const auto path = session / "frames" / fmt::format("{:06}.pgm", count);
  for (int k = 0; k < 6000 && !std::filesystem::exists(path); ++k) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  ASSERT_TRUE(std::filesystem::exists(path));
}

TEST(CaptureVerb, TheFirstInterruptEndsResumablyTheSecondAtOnce) {
  const TempFolder folder;
  const std::string rig = Rig(folder).string();
  const std::string out = (folder / "s").string();
  {
    const Process first({"capture", rig, "--out", out});
    AwaitPictures(out, 5);
    first.Signal(SIGINT);
    const int status = first.Wait();
    ASSERT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 75);
  }
  const std::int64_t count = acquire::SessionReader(out).picture_count();
  EXPECT_GE(count, 5);
  {
    const Process second({"capture", rig, "--out", out, "--resume"});
    AwaitPictures(out, static_cast<int>(count) + 5);
    second.Signal(SIGINT);
    second.Signal(SIGTERM);  // of another number: two of the same might become one
    const int status = second.Wait();
    EXPECT_TRUE(WIFSIGNALED(status) ||
                (WIFEXITED(status) && WEXITSTATUS(status) == 75));
  }
  const Json summary = RunJson({"capture", rig, "--out", out, "--resume"});
  EXPECT_EQ(summary.at("pictures"), acquire::SessionReader(out).schedule().size());
}

TEST(CaptureVerb, AFullDiskSaysHowToGoOn) {
  const TempFolder folder;
  const std::string rig = Rig(folder).string();
  const std::string out = (folder / "s").string();
  const pid_t child = ::fork();
  if (child == 0) {  // a file may have 100 kB, a frame has 198
    ::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{100'000, 100'000};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    try {
      CaptureRequest request;
      request.rig = rig;
      request.out = out;
      RunCapture(request, {});
    } catch (const Error& e) {
      const std::string text = e.what();
      ::_exit(text.find("--resume") != std::string::npos &&
                      text.find("File too large") != std::string::npos
                  ? 0
                  : 1);
    }
    ::_exit(2);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

}  // namespace
}  // namespace nacre::cli
