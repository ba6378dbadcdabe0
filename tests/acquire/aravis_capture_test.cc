// A session taken by the true driver from a device that loses packets, frames and its
// connection, against one that loses nothing.

#include "acquire/aravis_camera.h"
#include "core/atomic_file.h"
#include "rigs/gige_camera_twin.h"
#include "tests/acquire/fake_rig.h"
#include "tests/support/temp_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>

namespace nacre::testing {
namespace {

using namespace std::chrono_literals;
using rigs::CameraFault;
using rigs::GigeCameraTwin;

// A laser and a stage that record, a camera that is true but for its device.
struct Rig {
  explicit Rig(double reconnect_s)
      : camera({.id = twin.address(),
                .pixel_format = "Mono12p",
                .packet_size_bytes = 576,
                .reconnect_s = reconnect_s}) {}

  acquire::CaptureSummary Take(acquire::SessionWriter& session) {
    FakeState state;
    FakeLaser laser(state);
    FakeStage stage(state);
    return acquire::CaptureCalibration(session, {camera, laser, stage});
  }
  acquire::SessionManifest Manifest() const {
    FakeState state;
    return acquire::MakeManifest(
        TestRig(), camera.Info(), FakeLaser(state).Info(), std::nullopt);
  }

  GigeCameraTwin twin{{.count = [](int x, int y, double exposure_us) {
    return static_cast<std::uint32_t>((x + 3 * y) * exposure_us / 300);
  }}};
  acquire::AravisCamera camera;
};

std::vector<std::string> Frames(const std::filesystem::path& folder) {
  const acquire::SessionReader session(folder);
  std::vector<std::string> hashes;
  for (std::int64_t k = 0; k < session.picture_count(); ++k) {
    session.ReadFrame(k);  // verifies its checksum
    hashes.push_back(session.Entry(k).hash);
  }
  return hashes;
}

TEST(AravisCaptureTest, FaultsChangeNoPicture) {
  const TempFolder folder;
  Rig good(10);
  auto session =
      acquire::SessionWriter::Create(folder.path() / "good", good.Manifest(), false);
  const std::int64_t pictures = good.Take(session).pictures_taken;
  ASSERT_GT(pictures, 10);

  Rig bad(10);
  std::vector<CameraFault> faults;
  for (int k = 0; k < 4; ++k) {
    faults.insert(faults.end(),
                  {CameraFault::kNone,
                   CameraFault::kDropPacket,
                   CameraFault::kSkipId,
                   CameraFault::kDropPacket});
  }
  bad.twin.Script(faults);
  auto marred =
      acquire::SessionWriter::Create(folder.path() / "bad", bad.Manifest(), false);
  std::jthread thief([&] {
    while (bad.twin.frames_sent() < 20) {
      std::this_thread::sleep_for(1ms);
    }
    bad.twin.GiveControlAway();
    std::this_thread::sleep_for(300ms);
    bad.twin.Plug();
  });
  const acquire::CaptureSummary summary = bad.Take(marred);
  thief.join();
  EXPECT_EQ(summary.pictures_taken, pictures);
  EXPECT_GE(summary.frames_lost, 12);
  EXPECT_EQ(bad.camera.Statistics().reconnections, 1);
  EXPECT_EQ(Frames(folder.path() / "bad"), Frames(folder.path() / "good"));
}

TEST(AravisCaptureTest, ACameraThatStaysAwayLeavesASessionThatGoesOn) {
  const TempFolder folder;
  Rig rig(0.3);
  {
    auto session =
        acquire::SessionWriter::Create(folder.path() / "s", rig.Manifest(), false);
    rig.camera.SetExposureUs(500);
    rig.twin.Script(std::vector<CameraFault>(4, CameraFault::kDropPacket));
    EXPECT_THROW(rig.Take(session), Error);  // lost four times
    rig.twin.GiveControlAway();
    try {
      rig.Take(session);
      FAIL() << "the camera was gone";
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ExitCode::kDevice);
    }
  }
  rig.twin.Plug();
  auto session =
      acquire::SessionWriter::Resume(folder.path() / "s", rig.Manifest(), false);
  rig.Take(session);
  EXPECT_EQ(session.picture_count(), session.schedule().grid_begin());
}

}  // namespace
}  // namespace nacre::testing
