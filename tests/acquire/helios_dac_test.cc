// The true driver through the true libusb, against a device on an emulated USB.

#include "acquire/helios_dac.h"

#include "acquire/helios_illuminator.h"
#include "acquire/laser_watchdog.h"
#include "core/error.h"
#include "rigs/helios_dac_twin.h"
#include "tests/support/error_message.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <fstream>
#include <iterator>
#include <spawn.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

namespace nacre::testing {
namespace {

using namespace std::chrono_literals;
using rigs::HeliosDacTwin;
using rigs::MonotonicNs;
using ::testing::HasSubstr;

acquire::HeliosOptions Options() {
  acquire::HeliosOptions options;
  options.max_angle_rad = 0.3;
  options.power = {0.5, 0.5};
  options.reconnect_s = 20;
  return options;
}

acquire::SafetyDescription Safety() {
  return {.field_x_rad = {-0.2, 0.2},
          .field_y_rad = {-0.1, 0.1},
          .max_power = 0.6,
          .max_dwell_us = 5000,
          .max_duty = 0.9,
          .max_lit_s = 100};
}

acquire::SpotTiming Timing() {
  const std::array exposures_us{40'000.0, 20'000.0};
  return acquire::PlanSpots(exposures_us, 4, 300, 20'000);
}

acquire::HeliosIlluminator Laser() {
  return {Options(), Safety(), Timing(), {"R", "G"}};
}

std::string DeviceMessage(const std::function<void()>& call) {
  return ErrorMessage(call, ExitCode::kDevice);
}

// This program again, running one of its disabled tests.
pid_t RunDisabledTest(const std::string& name) {
  std::string program = "/proc/self/exe";
  std::string filter = "--gtest_filter=" + name;
  std::string disabled = "--gtest_also_run_disabled_tests";
  std::array<char*, 4> argv{program.data(), filter.data(), disabled.data(), nullptr};
  pid_t pid = -1;
  EXPECT_EQ(posix_spawn(&pid, program.c_str(), nullptr, nullptr, argv.data(), environ),
            0);
  return pid;
}

// The children of this process that its main thread started.
std::vector<pid_t> Children() {
  std::ifstream file("/proc/self/task/" + std::to_string(getpid()) + "/children");
  return {std::istream_iterator<pid_t>(file), {}};
}

const std::array<acquire::ScanAngle, 2> kSpots{{{0.1, 0.05}, {-0.15, -0.02}}};

TEST(HeliosDac, IsFoundNamedAndOpenedByName) {
  EXPECT_TRUE(acquire::FindHeliosDacs().empty());
  EXPECT_THAT(DeviceMessage([] { acquire::HeliosDac(""); }),
              HasSubstr("not found; there is none"));
  HeliosDacTwin one({.name = "bench one", .firmware = 7, .port = 1});
  HeliosDacTwin two({.name = "bench two", .port = 2});
  const auto found = acquire::FindHeliosDacs();
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].name, "bench one");
  EXPECT_EQ(found[0].firmware, 7U);
  EXPECT_EQ(found[1].name, "bench two");
  EXPECT_THAT(DeviceMessage([] { acquire::HeliosDac(""); }),
              HasSubstr("there are several"));
  EXPECT_THAT(DeviceMessage([] { acquire::HeliosDac("bench three"); }),
              HasSubstr("there is bench one, bench two"));
  {
    const acquire::HeliosDac dac("bench two");
    EXPECT_EQ(dac.name(), "bench two");
    EXPECT_EQ(acquire::FindHeliosDacs()[1].trouble, "another program has it");
  }
  acquire::NameHeliosDac(found[0].bus, found[0].address, "bench two");
  EXPECT_EQ(one.name(), "bench two");
  EXPECT_THAT(DeviceMessage([] { acquire::HeliosDac("bench two"); }),
              HasSubstr("there are several"));
  EXPECT_EQ(one.counts().malformed + two.counts().malformed, 0);
}

TEST(HeliosIlluminator, IsDarkUntilArmedAndLitUntilBlanked) {
  HeliosDacTwin twin;
  acquire::HeliosIlluminator laser = Laser();
  EXPECT_EQ(laser.Info().serial, "Helios 12345");
  EXPECT_THAT(DeviceMessage([&] { laser.Light(kSpots, 0); }), HasSubstr("disarmed"));
  laser.Arm();
  EXPECT_TRUE(twin.LitSpans().empty());
  laser.Light(kSpots, 1);
  const auto frame = twin.Emitting();
  ASSERT_NE(frame, nullptr);
  for (const acquire::LaserPoint& point : frame->points) {
    EXPECT_EQ(point.r, 0);
    EXPECT_TRUE(point.g == 0 || point.g == 127);
  }
  std::this_thread::sleep_for(200ms);
  EXPECT_NE(twin.Emitting(), nullptr);
  laser.Blank();
  EXPECT_EQ(twin.Emitting(), nullptr);
  EXPECT_TRUE(twin.IsShutterOpen());
  laser.Disarm();
  EXPECT_FALSE(twin.IsShutterOpen());
  EXPECT_EQ(twin.counts().looping, 0);
  EXPECT_EQ(twin.counts().malformed, 0);
}

TEST(HeliosIlluminator, AnEmergencyStopLasts) {
  HeliosDacTwin twin;
  acquire::HeliosIlluminator laser = Laser();
  laser.Arm();
  laser.Light(kSpots, 0);
  laser.EmergencyStop("the door is open");
  EXPECT_EQ(twin.Emitting(), nullptr);
  EXPECT_FALSE(twin.IsShutterOpen());
  EXPECT_THAT(DeviceMessage([&] { laser.Arm(); }), HasSubstr("the door is open"));
  EXPECT_THAT(DeviceMessage([&] { laser.Light(kSpots, 0); }), HasSubstr("stopped"));
  laser.ClearEmergencyStop();
  EXPECT_THAT(DeviceMessage([&] { laser.Light(kSpots, 0); }), HasSubstr("disarmed"));
  laser.Arm();
  laser.Light(kSpots, 0);
  EXPECT_NE(twin.Emitting(), nullptr);
}

TEST(HeliosIlluminator, WhatLiesOutsideTheFieldEndsAllLight) {
  HeliosDacTwin twin;
  acquire::HeliosIlluminator laser = Laser();
  laser.Arm();
  laser.Light(kSpots, 0);
  const std::array<acquire::ScanAngle, 1> outside{{{0.0, 0.11}}};
  EXPECT_THAT(DeviceMessage([&] { laser.Light(outside, 0); }),
              HasSubstr("outside of the scan field"));
  EXPECT_EQ(twin.Emitting(), nullptr);
  EXPECT_EQ(laser.state(), acquire::LaserState::kDisarmed);
  EXPECT_FALSE(twin.IsShutterOpen());
}

TEST(HeliosIlluminator, FaultsAreCountedAndSurvived) {
  HeliosDacTwin twin;
  acquire::HeliosIlluminator laser = Laser();
  laser.Arm();
  laser.Light(kSpots, 0);
  const auto survives = [&](const char* what) {
    SCOPED_TRACE(what);
    const auto before = laser.Interruptions();
    for (int wait = 0; laser.Interruptions() == before && wait < 1000; ++wait) {
      std::this_thread::sleep_for(5ms);
    }
    EXPECT_GT(laser.Interruptions(), before);
    laser.AwaitSteady();
    EXPECT_NE(twin.Emitting(), nullptr);
  };
  twin.StallAfter(3);
  survives("a stalled bulk transfer");
  twin.HangAfter(5);
  survives("an answer that never comes");
  twin.UnplugAfter(2, 100ms);
  survives("an unplugged DAC");
}

TEST(HeliosIlluminator, ADacThatStaysAwayIsAnErrorAndMayComeBack) {
  HeliosDacTwin twin;
  acquire::HeliosOptions options = Options();
  options.reconnect_s = 0.3;
  acquire::HeliosIlluminator laser(options, Safety(), Timing(), {"R", "G"});
  laser.Arm();
  twin.Unplug();
  EXPECT_THAT(DeviceMessage([&] { laser.Light(kSpots, 0); }), HasSubstr("--resume"));
  laser.Blank();
  twin.Plug();
  laser.Light(kSpots, 0);
  EXPECT_NE(twin.Emitting(), nullptr);
}

// Not a test by itself: the program that the test below starts and kills.
TEST(LaserWatchdogChild, DISABLED_LightsForEver) {
  acquire::HeliosIlluminator laser = Laser();
  laser.Arm();
  laser.Light(kSpots, 0);
  std::this_thread::sleep_for(60s);
}

TEST(LaserWatchdog, EndsTheLightOfAProgramThatIsKilled) {
  HeliosDacTwin twin;
  const pid_t child = RunDisabledTest("LaserWatchdogChild.DISABLED_LightsForEver");
  for (int wait = 0; !twin.Emitting() && wait < 4000; ++wait) {
    std::this_thread::sleep_for(5ms);
  }
  ASSERT_NE(twin.Emitting(), nullptr);
  std::this_thread::sleep_for(100ms);
  const std::int64_t killed_ns = MonotonicNs();
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  for (int wait = 0; twin.IsShutterOpen() && wait < 1000; ++wait) {
    std::this_thread::sleep_for(5ms);
  }
  EXPECT_FALSE(twin.IsShutterOpen());
  EXPECT_GT(twin.LitSpans().back().end_ns, killed_ns);
  EXPECT_LE(twin.LitSpans().back().end_ns - killed_ns, 50'000'000);
}

TEST(LaserWatchdog, NoLightWithoutIt) {
  HeliosDacTwin twin;
  acquire::HeliosIlluminator laser = Laser();
  const std::vector<pid_t> children = Children();
  ASSERT_EQ(children.size(), 1U);
  laser.Arm();
  laser.Light(kSpots, 0);
  kill(children[0], SIGKILL);
  for (int wait = 0; laser.Interruptions() == 0 && wait < 1000; ++wait) {
    std::this_thread::sleep_for(5ms);
  }
  EXPECT_GT(laser.Interruptions(), 0);
  laser.AwaitSteady();  // with another
  EXPECT_NE(twin.Emitting(), nullptr);
}

}  // namespace
}  // namespace nacre::testing
