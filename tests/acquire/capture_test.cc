#include "acquire/capture.h"

#include "core/atomic_file.h"
#include "tests/acquire/fake_rig.h"
#include "tests/support/temp_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

namespace nacre::acquire {
namespace {

using testing::FakeRig;
using ::testing::HasSubstr;
using testing::IdealScanMap;
using testing::TempFolder;
using testing::TestRig;

// Captures all that is missing, as the capture verb does.
void CaptureAll(SessionWriter& session,
                FakeRig& fake,
                const ProgressFunction& progress = {}) {
  CaptureCalibration(session, fake.devices(), progress);
  CaptureGrid(session, fake.devices(), IdealScanMap(300), progress);
}

SessionWriter OpenOrCreate(const std::filesystem::path& folder, const FakeRig& fake) {
  const SessionManifest manifest = fake.Manifest(TestRig());
  return std::filesystem::exists(folder / "session.json")
             ? SessionWriter::Resume(folder, manifest, false)
             : SessionWriter::Create(folder, manifest, false);
}

// Every byte of a session but for the lock.
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

std::map<std::string, std::string> UninterruptedContents() {
  const TempFolder folder;
  FakeRig fake;
  {
    SessionWriter session = OpenOrCreate(folder / "s", fake);
    CaptureAll(session, fake);
  }
  return Contents(folder / "s");
}

TEST(Capture, TakesTheWholeSchedule) {
  const TempFolder folder;
  FakeRig fake;
  SessionWriter session = OpenOrCreate(folder / "s", fake);
  const CaptureSummary targets = CaptureCalibration(session, fake.devices());
  EXPECT_EQ(targets.pictures_taken, session.schedule().grid_begin());
  EXPECT_TRUE(fake.state.spots.empty()) << "the laser must be dark afterwards";
  const CaptureSummary grid = CaptureGrid(session, fake.devices(), IdealScanMap(300));
  EXPECT_EQ(grid.pictures_taken, 64);
  EXPECT_TRUE(fake.state.spots.empty());
  EXPECT_TRUE(SessionReader(folder / "s").IsComplete());
}

TEST(Capture, AimsAtTheGridPointsOfEachGroup) {
  const TempFolder folder;
  FakeRig fake;
  SessionWriter session = OpenOrCreate(folder / "s", fake);
  CaptureCalibration(session, fake.devices());
  std::int64_t checked = 0;
  fake.camera.before_capture = [&](std::uint64_t number) {
    const ScheduledPicture& picture =
        session.schedule()[static_cast<std::int64_t>(number)];
    EXPECT_EQ(fake.state.target, Target::kSample);
    EXPECT_EQ(fake.state.channel, picture.channel);
    EXPECT_EQ(fake.state.exposure_us, picture.exposure_us + 0.25);
    const auto group = session.schedule().Group(picture.group);
    ASSERT_EQ(fake.state.spots.size(), group.size());
    for (std::size_t k = 0; k < group.size(); ++k) {
      const PointMm p = session.rig().grid.Point(group[k].i, group[k].j);
      EXPECT_DOUBLE_EQ(fake.state.spots[k].x_rad, p.x / 300);
      EXPECT_DOUBLE_EQ(fake.state.spots[k].y_rad, p.y / 300);
    }
    ++checked;
  };
  CaptureGrid(session, fake.devices(), IdealScanMap(300));
  EXPECT_EQ(checked, 64);
}

TEST(Capture, LightsTargetsAsTheScheduleSays) {
  const TempFolder folder;
  FakeRig fake;
  SessionWriter session = OpenOrCreate(folder / "s", fake);
  fake.camera.before_capture = [&](std::uint64_t number) {
    const ScheduledPicture& picture =
        session.schedule()[static_cast<std::int64_t>(number)];
    EXPECT_EQ(fake.state.target, picture.target);
    EXPECT_EQ(fake.state.pose, picture.pose);
    EXPECT_EQ(fake.state.channel, picture.channel);
    EXPECT_EQ(fake.state.spots.size(), picture.target == Target::kReference ? 25U : 0U);
  };
  CaptureCalibration(session, fake.devices());
}

TEST(Capture, AsksAgainForLostFrames) {
  const TempFolder folder;
  FakeRig fake;
  SessionWriter session = OpenOrCreate(folder / "s", fake);
  fake.camera.before_capture = [&](std::uint64_t number) {
    if (number == 5 && fake.state.captured.size() == 6) {
      fake.camera.lose_next = 3;
    }
  };
  const CaptureSummary summary = CaptureCalibration(session, fake.devices());
  EXPECT_EQ(summary.frames_lost, 3);
  EXPECT_EQ(std::count(fake.state.captured.begin(), fake.state.captured.end(), 5U), 4);
  EXPECT_EQ(session.picture_count(), session.schedule().grid_begin());
}

TEST(Capture, GivesUpOnACameraThatLosesEverything) {
  const TempFolder folder;
  FakeRig fake;
  SessionWriter session = OpenOrCreate(folder / "s", fake);
  CaptureCalibration(session, fake.devices());
  fake.camera.lose_next = 1000;
  try {
    CaptureGrid(session, fake.devices(), IdealScanMap(300));
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::kDevice);
    EXPECT_THAT(e.what(), HasSubstr("picture 21: the camera lost the frame 4 times"));
  }
  EXPECT_TRUE(fake.state.spots.empty()) << "the laser must be dark after an error";
}

TEST(Capture, RefusesAFrameOfAnotherSize) {
  const TempFolder folder;
  FakeRig fake;
  SessionWriter session = OpenOrCreate(folder / "s", fake);
  fake.camera.edit_frame = [](Frame& frame) { frame.counts.pop_back(); };
  EXPECT_THROW(CaptureCalibration(session, fake.devices()), Error);
  EXPECT_EQ(session.picture_count(), 0);
}

TEST(Capture, RefusesCountsBeyondTheConverter) {
  const TempFolder folder;
  FakeRig fake;
  SessionWriter session = OpenOrCreate(folder / "s", fake);
  fake.camera.edit_frame = [](Frame& frame) { frame.counts[3] = 4096; };
  try {
    CaptureCalibration(session, fake.devices());
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::kDevice);
    EXPECT_THAT(e.what(), HasSubstr("a count of 4096 from a camera of 12 bits"));
  }
}

TEST(Capture, StoppedAtAnyPictureAndResumedIsTheSame) {
  const auto expected = UninterruptedContents();
  for (const std::int64_t stop_after : {1, 7, 20, 21, 22, 50, 84}) {
    const TempFolder folder;
    FakeRig fake;
    const auto stop = [&](const Progress& state) { return state.done < stop_after; };
    {
      SessionWriter session = OpenOrCreate(folder / "s", fake);
      try {
        CaptureAll(session, fake, stop);
        FAIL();
      } catch (const Error& e) {
        EXPECT_EQ(e.code(), ExitCode::kInterrupted);
      }
      EXPECT_EQ(session.picture_count(), stop_after) << "the frame in flight is kept";
      EXPECT_TRUE(fake.state.spots.empty());
    }
    SessionWriter session = OpenOrCreate(folder / "s", fake);
    EXPECT_EQ(session.picture_count(), stop_after);
    CaptureAll(session, fake);
    EXPECT_EQ(Contents(folder / "s"), expected) << "stopped after " << stop_after;
  }
}

TEST(Capture, KilledAtRandomInstantsAndResumedIsTheSame) {
  const auto expected = UninterruptedContents();
  const TempFolder folder;
  constexpr std::uint64_t kSeed = 20240607;
  RandomStream random(kSeed, 0);
  int killed = 0;
  for (int round = 0;; ++round) {
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      FakeRig fake;
      fake.camera.before_capture = [](std::uint64_t) { ::usleep(300); };
      try {
        SessionWriter session = OpenOrCreate(folder / "s", fake);
        CaptureAll(session, fake);
      } catch (const std::exception&) {
        ::_exit(1);
      }
      ::_exit(0);
    }
    if (round < 10) {
      ::usleep(static_cast<useconds_t>(500 + random.Uniform() * 8000));
      ::kill(child, SIGKILL);
    }
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    killed += WIFSIGNALED(status) ? 1 : 0;
    if (!WIFSIGNALED(status)) {
      ASSERT_EQ(WEXITSTATUS(status), 0);
      break;
    }
  }
  EXPECT_GE(killed, 3) << "too few rounds were interrupted to show anything";
  EXPECT_EQ(Contents(folder / "s"), expected);
}

TEST(Capture, ResumeTakesDamagedFramesAgain) {
  const auto expected = UninterruptedContents();
  const TempFolder folder;
  FakeRig fake;
  {
    SessionWriter session = OpenOrCreate(folder / "s", fake);
    CaptureAll(session, fake);
  }
  // As after a power cut: an empty frame, and a torn line after it.
  WriteFile(folder / "s" / "frames" / "000080.pgm", "");
  std::string journal = ReadFile(folder / "s" / "journal");
  WriteFile(folder / "s" / "journal", journal.substr(0, journal.size() - 10));
  SessionWriter session = OpenOrCreate(folder / "s", fake);
  EXPECT_EQ(session.picture_count(), 80);
  EXPECT_EQ(session.dropped_count(), 4);
  CaptureAll(session, fake);
  EXPECT_EQ(Contents(folder / "s"), expected);
}

TEST(Capture, DurableWritesTheSame) {
  const TempFolder folder;
  FakeRig fake;
  SessionWriter session =
      SessionWriter::Create(folder / "s", fake.Manifest(TestRig()), true);
  CaptureAll(session, fake);
  session.Flush();
  EXPECT_EQ(Contents(folder / "s"), UninterruptedContents());
}

TEST(Capture, PlanCountsPicturesTimeAndDisk) {
  const FakeRig fake;
  const CapturePlan plan = PlanCapture(TestRig(), fake.camera.Info());
  EXPECT_EQ(plan.target_pictures, 21);
  EXPECT_EQ(plan.grid_pictures, 64);
  EXPECT_EQ(plan.spot_groups, 16);
  // Two of each: 500 + 1000 + 1500 + 2000 + 4000 + 8000 dark; 3 boards of 2000; two
  // flats of 500 and 1500; two references of 4000; 32 of 8000 and 1000.
  EXPECT_NEAR(plan.exposure_seconds,
              1e-6 * (2 * 17000 + 3 * 2000 + 2 * 2000 + 2 * 4000 + 32 * 9000),
              1e-12);
  EXPECT_GE(plan.disk_bytes, 85U * 48U);
}

}  // namespace
}  // namespace nacre::acquire
