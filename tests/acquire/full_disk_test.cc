// A disk that fills up while a session is captured: a real file system of a few hundred
// kilobytes, mounted for a child process alone.

#include "acquire/capture.h"
#include "core/atomic_file.h"
#include "tests/acquire/fake_rig.h"
#include "tests/support/temp_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fmt/format.h>
#include <fstream>
#include <sched.h>
#include <sys/mount.h>
#include <sys/wait.h>
#include <unistd.h>

namespace nacre::acquire {
namespace {

using testing::FakeRig;
using testing::IdealScanMap;
using testing::TempFolder;
using testing::TestRig;

constexpr int kNotAllowed = 77;

void CapturePictures(SessionWriter& session, FakeRig& fake) {
  CaptureCalibration(session, fake.devices());
  CaptureGrid(session, fake.devices(), IdealScanMap(300));
}

// Mounts a disk of that size. What it is for dies with the process.
bool MountDisk(const std::filesystem::path& folder, int kilobytes) {
  const auto user = ::getuid();
  const auto group = ::getgid();
  if (::unshare(CLONE_NEWUSER | CLONE_NEWNS) != 0) {
    return false;
  }
  std::ofstream("/proc/self/setgroups") << "deny";
  std::ofstream("/proc/self/uid_map") << fmt::format("0 {} 1", user);
  std::ofstream("/proc/self/gid_map") << fmt::format("0 {} 1", group);
  return ::mount("none",
                 folder.c_str(),
                 "tmpfs",
                 0,
                 fmt::format("size={}k", kilobytes).c_str()) == 0;
}

// Captures into a disk that is too small, then into the same grown; the exit code says
// what went wrong.
int FillAndGoOn(const std::filesystem::path& disk,
                int kilobytes,
                const std::string& expected_journal) {
  if (!MountDisk(disk, kilobytes)) {
    return kNotAllowed;
  }
  const std::filesystem::path folder = disk / "s";
  FakeRig fake;
  const SessionManifest manifest = fake.Manifest(TestRig());
  bool full = false;
  try {
    auto session = SessionWriter::Create(folder, manifest, false);
    CapturePictures(session, fake);
  } catch (const Error& e) {
    full = std::string(e.what()).find("No space left on device") != std::string::npos;
    if (!full) {
      std::fprintf(stderr, "%s\n", e.what());
    }
  }
  if (!full || !fake.state.spots.empty()) {
    return 1;
  }
  if (std::filesystem::exists(folder / "session.json")) {  // what is there is whole
    const SessionReader session(folder);
    for (std::int64_t k = 0; k < session.picture_count(); ++k) {
      session.ReadFrame(k);
    }
  }
  if (::mount("none", disk.c_str(), "tmpfs", MS_REMOUNT, "size=8m") != 0) {
    return 2;
  }
  auto session = std::filesystem::exists(folder / "session.json")
                     ? SessionWriter::Resume(folder, manifest, false)
                     : SessionWriter::Create(folder, manifest, false);
  CapturePictures(session, fake);
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (name != "frames" && name != "journal" && name != "lock" &&
        name != "session.json") {
      return 3;  // something half written was left
    }
  }
  return ReadFile(folder / "journal") == expected_journal ? 0 : 4;
}

// Sizes that end in a frame, in the journal and in the manifest.
TEST(FullDisk, StopsResumablyWithNothingCorrupt) {
  std::string expected;
  {
    const TempFolder folder;
    FakeRig fake;
    auto session = SessionWriter::Create(folder / "s", fake.Manifest(TestRig()), false);
    CapturePictures(session, fake);
    expected = ReadFile(folder / "s" / "journal");
  }
  for (const int kilobytes : {16, 24, 60, 100, 116, 120, 124, 128, 200, 300}) {
    const TempFolder disk;
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      int code = 5;
      try {
        code = FillAndGoOn(disk.path(), kilobytes, expected);
      } catch (const std::exception& e) {
        std::fprintf(stderr, "%s\n", e.what());
      }
      ::_exit(code);
    }
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFEXITED(status));
    if (WEXITSTATUS(status) == kNotAllowed) {
      // A disk of so many kB is a mount of the test's own, which some systems forbid.
      GTEST_SKIP() << "no user name spaces here";
    }
    EXPECT_EQ(WEXITSTATUS(status), 0) << kilobytes << " kB";
  }
}

}  // namespace
}  // namespace nacre::acquire
