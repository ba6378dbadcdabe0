// The driver against a GigE Vision device on the loopback interface: true sockets, true
// protocol, on both sides of which nothing is replaced.

#include "acquire/aravis_camera.h"

#include "core/error.h"
#include "rigs/gige_camera_twin.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fmt/format.h>
#include <thread>
#include <unistd.h>

namespace nacre::acquire {
namespace {

using namespace std::chrono_literals;
using rigs::CameraFault;
using rigs::GigeCameraTwin;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::Field;
using ::testing::HasSubstr;

constexpr auto kTimeout = 3s;

AravisOptions OptionsOf(const GigeCameraTwin& twin) {
  return {.id = twin.address(), .pixel_format = "Mono16", .reconnect_s = 10};
}

std::string MessageOf(const std::function<void()>& act) {
  try {
    act();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::kDevice);
    return e.what();
  }
  return "no error";
}

// A frame as soon as one is whole: the socket's buffer is resized before the first.
Frame Take(AravisCamera& camera) {
  for (int attempt = 0; attempt < 4; ++attempt) {
    if (auto frame = camera.Capture(0, kTimeout)) {
      return *frame;
    }
  }
  const CameraStatistics counted = camera.Statistics();
  throw DeviceError(fmt::format(
      "four frames were lost: {} incomplete, {} timed out, {} late, {} out of turn",
      counted.incomplete,
      counted.timed_out,
      counted.late,
      counted.skipped_ids));
}

struct FormatCase {
  const char* name;
  int bit_depth;
  std::uint32_t max;
  const char* mosaic = "";
  int samples = 1;
};

class AravisFormatTest : public ::testing::TestWithParam<FormatCase> {};

TEST_P(AravisFormatTest, CountsArriveBitForBit) {
  const auto count = [](int x, int y, double exposure_us) {
    return static_cast<std::uint32_t>((x * 257 + y * 4099 + 11) * exposure_us / 1000);
  };
  const GigeCameraTwin twin({.width = 68, .height = 36, .count = count});
  AravisOptions options = OptionsOf(twin);
  options.pixel_format = GetParam().name;
  options.packet_size_bytes = 576;  // several packets a frame, the last one shorter
  AravisCamera camera(options);
  const CameraInfo info = camera.Info();
  EXPECT_EQ(info.model, "Nacre GigeTwin");
  EXPECT_EQ(info.serial, "T1");
  EXPECT_EQ(info.bit_depth, GetParam().bit_depth);
  EXPECT_EQ(info.mosaic, GetParam().mosaic);
  for (const double exposure_us : {100.0, 900.0}) {
    camera.SetExposureUs(exposure_us);
    const Frame frame = Take(camera);
    const int row = 68 * GetParam().samples;
    ASSERT_EQ(frame.counts.size(), static_cast<std::size_t>(row) * 36);
    EXPECT_EQ(frame.exposure_us, exposure_us);
    for (int y = 0; y < 36; ++y) {
      for (int x = 0; x < row; ++x) {
        ASSERT_EQ(frame.counts[static_cast<std::size_t>(y * row + x)],
                  std::min(GetParam().max, count(x, y, exposure_us)))
            << x << ' ' << y;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Aravis,
                         AravisFormatTest,
                         ::testing::Values(FormatCase{"Mono8", 8, 0xFF},
                                           FormatCase{"Mono12", 12, 0xFFF},
                                           FormatCase{"Mono12p", 12, 0xFFF},
                                           FormatCase{"Mono16", 16, 0xFFFF},
                                           FormatCase{"BayerRG8", 8, 0xFF, "RGGB"},
                                           FormatCase{"BayerGB12", 12, 0xFFF, "GBRG"},
                                           FormatCase{"BayerRG12p", 12, 0xFFF, "RGGB"},
                                           FormatCase{"BayerBG16", 16, 0xFFFF, "BGGR"},
                                           FormatCase{"RGB8", 8, 0xFF, "RGB", 3}),
                         [](const auto& name) { return name.param.name; });

TEST(AravisCameraTest, ExposuresAreRoundedAndReadBack) {
  const GigeCameraTwin twin;
  AravisCamera camera(OptionsOf(twin));
  EXPECT_EQ(camera.Info().min_exposure_us, 10);
  EXPECT_EQ(camera.Info().max_exposure_us, 1e6);
  EXPECT_EQ(camera.SetExposureUs(1234.4), 1234);
  EXPECT_THAT(MessageOf([&] { camera.SetExposureUs(5); }),
              AllOf(HasSubstr(twin.address()), HasSubstr("[10, 1000000] us")));
}

TEST(AravisCameraTest, TakesRegionAndGain) {
  const GigeCameraTwin twin;
  AravisOptions options = OptionsOf(twin);
  options.region = SensorRegion{.x = 8, .y = 4, .width = 24, .height = 16};
  options.gain = 6;
  AravisCamera camera(options);
  EXPECT_EQ(twin.gain(), 6);
  const Frame frame = Take(camera);
  EXPECT_EQ(frame.width, 24);
  EXPECT_EQ(frame.height, 16);
  EXPECT_EQ(frame.counts.front(), 8 + 7 * 4);
}

TEST(AravisCameraTest, SaysWhatTheCameraTakesInstead) {
  const GigeCameraTwin twin;
  const auto message = [&](const std::function<void(AravisOptions&)>& edit) {
    AravisOptions options = OptionsOf(twin);
    edit(options);
    return MessageOf([&] { const AravisCamera camera(options); });
  };
  EXPECT_THAT(message([](auto& o) { o.pixel_format = "Mono14"; }),
              HasSubstr("it has Mono8, Mono12, Mono12p, Mono16, BayerRG8, "));
  EXPECT_THAT(message([](auto& o) { o.pixel_format = "YUV8"; }),
              HasSubstr("'YUV8' isn't a pixel format that Nacre reads"));
  EXPECT_THAT(message([](auto& o) { o.trigger = "Line7"; }),
              AllOf(HasSubstr("'Line7'"), HasSubstr("it has Software, Line1")));
  EXPECT_THAT(message([](auto& o) { o.gain = 25; }),
              HasSubstr("outside of its [0, 24]"));
  EXPECT_THAT(message([](auto& o) {
                o.region = SensorRegion{0, 0, 4000, 16};
              }),
              HasSubstr("set the size of its region"));
}

TEST(AravisCameraTest, AFrameTellsWhatTheCameraTells) {
  const GigeCameraTwin twin;
  AravisOptions options = OptionsOf(twin);
  options.gain = 5;
  AravisCamera camera(options);
  const Frame frame = Take(camera);
  EXPECT_EQ(frame.gain, 5);
  EXPECT_EQ(frame.temperature_c, 41);
  EXPECT_GT(frame.timestamp_ns, 0);
  EXPECT_EQ(frame.resent_packets, 0U);
}

TEST(AravisCameraTest, ThePicturesNumberGoesToTheCamera) {
  rigs::GigeCameraTwinOptions device{.width = 16, .height = 8};
  device.picture = [](std::uint64_t number, double exposure_us) {
    return std::vector<std::uint16_t>(
        128,
        static_cast<std::uint16_t>(100 * number +
                                   static_cast<std::uint64_t>(exposure_us)));
  };
  const GigeCameraTwin twin(device);
  AravisCamera camera(OptionsOf(twin));
  camera.SetExposureUs(20);
  Take(camera);
  for (const std::uint64_t number : {7U, 8U, 600U}) {
    const auto frame = camera.Capture(number, kTimeout);
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->counts.front(), 100 * number + 20);
  }
}

// The next frames come while nobody has looked at the last ones.
TEST(AravisCameraTest, PackedFramesKeepTheirCountsForAsLongAsOneLikes) {
  rigs::GigeCameraTwinOptions device{.width = 16, .height = 8};
  device.picture = [](std::uint64_t number, double) {
    return std::vector<std::uint16_t>(128, static_cast<std::uint16_t>(number));
  };
  const GigeCameraTwin twin(device);
  std::vector<PackedFrame> kept;
  {
    AravisCamera camera(OptionsOf(twin));
    Take(camera);
    for (std::uint64_t number = 1; number <= 20; ++number) {
      auto packed = camera.CapturePacked(number, kTimeout);
      ASSERT_TRUE(packed);
      kept.push_back(std::move(*packed));
    }
    EXPECT_EQ(std::move(kept[0]).Unpacked().counts.back(), 1);
  }
  for (std::size_t k = 1; k < kept.size(); ++k) {  // after the camera was closed, too
    EXPECT_EQ(std::move(kept[k]).Unpacked().counts.back(), k + 1);
  }
}

TEST(AravisCameraTest, ItSaysThatItIsAwayAndThatItIsBack) {
  GigeCameraTwin twin;
  AravisCamera camera(OptionsOf(twin));
  Take(camera);
  std::vector<bool> heard;
  camera.OnAway([&](bool away) {
    heard.push_back(away);
    if (away) {
      twin.Plug();
    }
  });
  twin.GiveControlAway();
  EXPECT_FALSE(camera.Capture(1, kTimeout));
  EXPECT_EQ(heard, (std::vector<bool>{true, false}));
}

TEST(AravisCameraTest, OneProgramControlsACamera) {
  const GigeCameraTwin twin;
  AravisOptions options = OptionsOf(twin);
  options.reconnect_s = 0.1;
  AravisCamera first(options);
  EXPECT_THAT(MessageOf([&] { const AravisCamera second(options); }),
              HasSubstr("another program controls it"));
  EXPECT_EQ(Take(first).width, 64);
}

TEST(AravisCameraTest, IsFoundByBroadcastAndMissedByName) {
  const std::string serial = fmt::format("found-{}", getpid());
  const GigeCameraTwin twin({.serial = serial});
  EXPECT_THAT(FindCameras(),
              Contains(AllOf(Field(&FoundCamera::serial, serial),
                             Field(&FoundCamera::address, twin.address()),
                             Field(&FoundCamera::protocol, "GigEVision"))));
  EXPECT_THAT(MessageOf([] { const AravisCamera camera({.id = "no-such-camera"}); }),
              HasSubstr("`nacre doctor` lists the cameras that answer"));
}

TEST(AravisCameraTest, BadFramesAreCountedAndNotHandedOn) {
  GigeCameraTwin twin;
  AravisOptions options = OptionsOf(twin);
  options.packet_size_bytes = 576;
  AravisCamera camera(options);
  Take(camera);
  const CameraStatistics before = camera.Statistics();

  twin.Script({CameraFault::kDropPacket, CameraFault::kNone});
  EXPECT_FALSE(camera.Capture(1, kTimeout));
  EXPECT_TRUE(camera.Capture(1, kTimeout));
  twin.Script({CameraFault::kNoFrame, CameraFault::kNone});
  EXPECT_FALSE(camera.Capture(2, 300ms));
  EXPECT_TRUE(camera.Capture(2, kTimeout));
  twin.Script({CameraFault::kSkipId, CameraFault::kNone});
  EXPECT_FALSE(camera.Capture(3, kTimeout));
  EXPECT_TRUE(camera.Capture(3, kTimeout));

  const CameraStatistics after = camera.Statistics();
  EXPECT_EQ(after.frames, before.frames + 3);
  EXPECT_EQ(after.incomplete, before.incomplete + 1);
  EXPECT_EQ(after.timed_out, before.timed_out + 1);
  EXPECT_EQ(after.skipped_ids, 1);
  EXPECT_GE(after.missing_packets, before.missing_packets + 1);
  EXPECT_EQ(after.reconnections, 0);
}

TEST(AravisCameraTest, AHardwareTriggerWaitsForItsNextPulse) {
  GigeCameraTwin twin;
  AravisOptions options = OptionsOf(twin);
  options.trigger = "Line1";
  AravisCamera camera(options);
  twin.PulseLine();
  std::this_thread::sleep_for(300ms);  // that frame comes while nobody waits
  std::jthread pulse([&] {
    std::this_thread::sleep_for(200ms);
    twin.PulseLine();
  });
  const auto frame = camera.Capture(0, kTimeout);
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->frame_id, 2U);
  EXPECT_EQ(camera.Statistics().late, 1);
}

TEST(AravisCameraTest, LostControlIsHadBackWithAllSettings) {
  GigeCameraTwin twin;
  AravisOptions options = OptionsOf(twin);
  options.gain = 3;
  AravisCamera camera(options);
  camera.SetExposureUs(777);
  Take(camera);
  twin.GiveControlAway();
  std::jthread back([&] {
    std::this_thread::sleep_for(500ms);
    twin.Plug();
  });
  EXPECT_FALSE(camera.Capture(1, kTimeout));
  EXPECT_EQ(camera.Statistics().reconnections, 1);
  EXPECT_EQ(twin.gain(), 3);
  EXPECT_EQ(Take(camera).exposure_us, 777);
}

TEST(AravisCameraTest, AnUnpluggedCameraIsWaitedFor) {
  GigeCameraTwin twin;
  AravisCamera camera(OptionsOf(twin));
  camera.SetExposureUs(500);
  Take(camera);
  twin.UnplugAtNextTrigger(3s);
  EXPECT_FALSE(camera.Capture(1, kTimeout));
  EXPECT_EQ(camera.Statistics().reconnections, 1);
  EXPECT_EQ(Take(camera).exposure_us, 500);
}

TEST(AravisCameraTest, ACameraThatStaysAwayIsAnErrorAndMayComeBackLater) {
  GigeCameraTwin twin;
  AravisOptions options = OptionsOf(twin);
  options.reconnect_s = 0.3;
  AravisCamera camera(options);
  camera.SetExposureUs(500);
  Take(camera);
  twin.GiveControlAway();
  EXPECT_THAT(MessageOf([&] { camera.Capture(1, kTimeout); }),
              AllOf(HasSubstr("tried for 0.3 s"), HasSubstr("--resume")));
  twin.Plug();
  EXPECT_EQ(Take(camera).exposure_us, 500);
}

}  // namespace
}  // namespace nacre::acquire
