// The limits one by one, and that no sequence of calls, faults and deaths leaves light
// on where or when there must be none.

#include "acquire/laser_feeder.h"
#include "acquire/spot_frames.h"
#include "tests/acquire/fake_dac.h"
#include "tests/support/error_message.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <rapidcheck.h>

namespace nacre::testing {
namespace {

using acquire::LaserFrame;
using acquire::LaserPoint;
using acquire::LaserSafety;
using acquire::LaserState;
using ::testing::HasSubstr;

constexpr int kPointsPerS = 20'000;

acquire::LaserLimits Limits() {
  return {.x_steps = {1000, 3000},
          .y_steps = {1500, 2500},
          .max_level = {200, 100, 50},
          .max_dwell_us = 1000,
          .max_duty = 0.2,
          .max_lit_s = 10};
}

// 400 points, 20 ms: dark but for `lit` points from `first` on.
LaserFrame Frame(int lit, LaserPoint point = {2000, 2000, 200, 0, 0, 200}) {
  LaserFrame frame;
  frame.points_per_s = kPointsPerS;
  frame.points.resize(400);
  std::fill_n(frame.points.begin() + 10, lit, point);
  return frame;
}

std::string Refusal(const LaserFrame& frame, double now_s = 0) {
  LaserSafety safety(Limits());
  safety.Arm();
  if (now_s > 0) {
    safety.Check(Frame(1), 0);
  }
  const std::string message =
      ErrorMessage([&] { safety.Check(frame, now_s); }, ExitCode::kDevice);
  EXPECT_EQ(safety.state(),
            message == "no error" ? LaserState::kLit : LaserState::kDisarmed);
  return message;
}

TEST(LaserSafety, WalksThroughItsStates) {
  LaserSafety safety(Limits());
  EXPECT_EQ(safety.state(), LaserState::kDisarmed);
  EXPECT_FALSE(safety.ShutterMayBeOpen());
  EXPECT_THROW(safety.Check(Frame(1), 0), Error);
  safety.Arm();
  EXPECT_TRUE(safety.ShutterMayBeOpen());
  const acquire::CheckedFrame lit = safety.Check(Frame(1), 0);
  EXPECT_EQ(safety.state(), LaserState::kLit);
  EXPECT_TRUE(lit.MayBePutOut());
  const acquire::CheckedFrame dark = safety.Check(Frame(0), 0);
  EXPECT_EQ(safety.state(), LaserState::kArmed);
  EXPECT_FALSE(lit.MayBePutOut());
  safety.Disarm();
  EXPECT_TRUE(dark.MayBePutOut());
  safety.EmergencyStop("smoke");
  EXPECT_THAT(ErrorMessage([&] { safety.Arm(); }, ExitCode::kDevice),
              HasSubstr("smoke"));
  safety.Disarm();
  EXPECT_EQ(safety.state(), LaserState::kStopped);
  safety.ClearEmergencyStop();
  EXPECT_EQ(safety.state(), LaserState::kDisarmed);
}

TEST(LaserSafety, HoldsEveryLimit) {
  EXPECT_EQ(Refusal(Frame(20)), "no error");
  EXPECT_THAT(Refusal(Frame(21)), HasSubstr("without a pause"));
  EXPECT_EQ(Refusal(Frame(1, {1000, 1500, 0, 100, 50, 200})), "no error");
  for (const LaserPoint outside : {LaserPoint{999, 2000, 1, 0, 0, 0},
                                   LaserPoint{3001, 2000, 1, 0, 0, 0},
                                   LaserPoint{2000, 1499, 0, 0, 0, 1},
                                   LaserPoint{2000, 2501, 0, 1, 0, 0}}) {
    EXPECT_THAT(Refusal(Frame(1, outside)), HasSubstr("outside of the scan field"));
  }
  for (const LaserPoint bright : {LaserPoint{2000, 2000, 201, 0, 0, 0},
                                  LaserPoint{2000, 2000, 0, 101, 0, 0},
                                  LaserPoint{2000, 2000, 0, 0, 51, 0},
                                  LaserPoint{2000, 2000, 0, 0, 0, 201}}) {
    EXPECT_THAT(Refusal(Frame(1, bright)), HasSubstr("above the limit"));
  }
  EXPECT_EQ(Refusal(Frame(1), 10), "no error");
  EXPECT_THAT(Refusal(Frame(1), 10.1), HasSubstr("has been lit for 10.1 s"));
}

TEST(LaserSafety, APauseOrAJitterDoesNotHideADwell) {
  LaserFrame frame = Frame(0);
  for (std::size_t k = 10; k < 390; ++k) {  // 12 steps to and fro, a pause every 16
    frame.points[k] = {static_cast<std::uint16_t>(2004 + 12 * (k % 2)),
                       2000,
                       k % 16 == 0 ? std::uint8_t{0} : std::uint8_t{9},
                       0,
                       0,
                       0};
  }
  EXPECT_THAT(Refusal(frame), HasSubstr("of the time"));
}

TEST(LaserSafety, HoldsTheShapeOfFrames) {
  LaserFrame frame = Frame(0);
  frame.points.resize(199);
  EXPECT_THAT(Refusal(frame), HasSubstr("must last 10 to 25 ms"));
  frame.points.resize(501);
  EXPECT_THAT(Refusal(frame), HasSubstr("must last 10 to 25 ms"));
  frame.points.clear();
  EXPECT_THAT(Refusal(frame), HasSubstr("a frame has 1 to 4095"));
  frame = Frame(1);
  frame.points.back() = frame.points[10];
  EXPECT_THAT(Refusal(frame), HasSubstr("begin and end dark"));
}

TEST(SpotFrames, EverySpotGetsTheSameShareOfEveryExposure) {
  const std::array exposures_us{80'000.0, 20'000.0};
  const acquire::SpotTiming timing =
      acquire::PlanSpots(exposures_us, 25, 300, kPointsPerS);
  EXPECT_EQ(timing.cycle_points, 400);
  EXPECT_EQ(timing.settle_points, 6);
  EXPECT_EQ(timing.dwell_points, 399 / 25 - 6);
  const acquire::ScanField field{0.3};
  const std::vector<acquire::ScanAngle> spots{{0.1, 0}, {-0.1, 0.1}, {0, -0.2}};
  const LaserFrame frame = acquire::MakeSpotFrame(timing, field, spots, {9, 0, 0});
  EXPECT_EQ(std::ssize(frame.points), timing.FramePoints());
  EXPECT_FALSE(frame.points.front().IsLit() || frame.points.back().IsLit());
  std::vector<int> lit(spots.size());
  int settled = 0;  // points in the same place
  for (std::size_t k = 0; k < frame.points.size(); ++k) {
    const LaserPoint& point = frame.points[k];
    const bool moved =
        k == 0 || point.x != frame.points[k - 1].x || point.y != frame.points[k - 1].y;
    settled = moved ? 0 : settled + 1;
    if (!point.IsLit()) {
      continue;
    }
    EXPECT_GE(settled, timing.settle_points);
    for (std::size_t s = 0; s < spots.size(); ++s) {
      lit[s] += point.x == field.StepFromAngle(spots[s].x_rad) &&
                        point.y == field.StepFromAngle(spots[s].y_rad)
                    ? 1
                    : 0;
    }
  }
  const int expected = timing.dwell_points * timing.cycles_per_frame;
  EXPECT_THAT(lit, ::testing::ElementsAre(expected, expected, expected));
}

TEST(SpotFrames, SaysWhatLeavesNoTime) {
  const auto message = [](std::vector<double> exposures_us, int spots) {
    return ErrorMessage(
        [&] { acquire::PlanSpots(exposures_us, spots, 300, kPointsPerS); },
        ExitCode::kDevice);
  };
  EXPECT_THAT(message({80'000, 800}, 25), HasSubstr("have 800 us in common"));
  EXPECT_THAT(message({80'010}, 4), HasSubstr("must be a whole number"));
  EXPECT_THAT(message({80'000}, 81), HasSubstr("take a cycle of 28400 us or more"));
  EXPECT_EQ(message({80'000, 800}, 2), "no error");
}

// ---- every sequence ----

enum class Act {
  kStep,
  kWait,
  kShow,
  kShowElsewhere,
  kShowOutside,
  kShowBright,
  kBlank,
  kArm,
  kDisarm,
  kStop,
  kClear,
  kUnplug,
  kPlug,
  kHang,
  kHeal,
  kKill,
  kEnd
};

// A program, its projector, its watch-dog, and who looks at them.
class Scene {
 public:
  Scene() {
    projector_.on_light = [](const LaserFrame& frame) {
      for (const LaserPoint& point : frame.points) {
        if (point.IsLit()) {
          RC_ASSERT(point.x >= 1000 && point.x <= 3000);
          RC_ASSERT(point.y >= 1500 && point.y <= 2500);
          RC_ASSERT(point.r <= 200 && point.g <= 100 && point.b <= 50);
        }
      }
    };
    Start();
  }
  ~Scene() { *is_dead_ = true; }
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  void Do(Act act, double share) {
    switch (act) {
      case Act::kStep:
        for (int k = 0; k < 12; ++k) {
          Pass(0.0005 + 0.002 * share);
          feeder_->Step();
          Look();
        }
        break;
      case Act::kWait:  // a program that has no time
        Pass(0.08 * share);
        break;
      case Act::kShow:
        Show(Frame(20));
        break;
      case Act::kShowElsewhere:
        Show(Frame(10, {1000, 2500, 0, 100, 0, 0}));
        break;
      case Act::kShowOutside:
        Show(Frame(1, {3001, 2000, 1, 0, 0, 0}));
        break;
      case Act::kShowBright:
        Show(Frame(1, {2000, 2000, 255, 0, 0, 0}));
        break;
      case Act::kBlank:
        feeder_->ShowNothing();
        break;
      case Act::kArm:
        if (ErrorMessage([&] { feeder_->Arm(); }, ExitCode::kDevice) == "no error") {
          allowed_ = true;
        }
        break;
      case Act::kDisarm:
        feeder_->Disarm();
        Forbid();
        break;
      case Act::kStop:
        feeder_->EmergencyStop("test");
        Forbid();
        break;
      case Act::kClear:
        feeder_->ClearEmergencyStop();
        break;
      case Act::kUnplug:
        projector_.Unplug();
        break;
      case Act::kPlug:
        projector_.plugged = true;
        break;
      case Act::kHang:
        projector_.hangs = true;
        break;
      case Act::kHeal:
        projector_.hangs = false;
        break;
      case Act::kKill:
        Kill(share);
        break;
      case Act::kEnd:
        break;
    }
    Look();
  }

  bool was_lit() const { return was_lit_; }

 private:
  void Start() {
    is_dead_ = std::make_shared<bool>(false);
    const bool there = std::exchange(projector_.hangs, false);
    const bool plugged = std::exchange(projector_.plugged, true);
    feeder_ = std::make_unique<acquire::LaserFeeder>(acquire::LaserFeeder::Settings{
        .limits = Limits(),
        .dark = acquire::MakeDarkFrame(kPointsPerS),
        .reconnect_s = 1,
        .open = [this,
                 dead =
                     is_dead_] { return std::make_unique<FakeDac>(projector_, dead); },
        .clock_s = [this] { return projector_.now_s; }});
    projector_.hangs = there;
    projector_.plugged = plugged;
  }

  void Show(const LaserFrame& frame) {
    ErrorMessage([&] { feeder_->Show(frame); }, ExitCode::kDevice);
  }

  // Nothing that the program does from now on reaches the projector; the watch-dog does
  // within 10 ms, unless that hangs; the program is started again.
  void Kill(double share) {
    *is_dead_ = true;
    Forbid();
    Pass(0.01 * share);
    if (projector_.plugged && !projector_.hangs) {
      projector_.Stop();
      projector_.shutter = false;
      Look();
      RC_ASSERT(!projector_.IsLit());
    }
    Start();
  }

  void Forbid() { allowed_ = false; }

  void Pass(double seconds) {
    for (double left_s = seconds; left_s > 0; left_s -= 0.001) {
      projector_.Advance(std::min(left_s, 0.001));
      Look();
    }
  }

  void Look() {
    const bool may_be_lit = allowed_ && !*is_dead_ &&
                            (feeder_->state() == LaserState::kArmed ||
                             feeder_->state() == LaserState::kLit);
    if (!may_be_lit && may_be_lit_) {
      dark_since_s_ = projector_.now_s;
      reachable_ = feeder_->HasDac() && !projector_.hangs && !*is_dead_;
    }
    may_be_lit_ = may_be_lit;
    if (!projector_.IsLit()) {
      return;
    }
    was_lit_ = true;
    if (!may_be_lit) {  // dark at once if the program reached it, else by itself
      RC_ASSERT(!reachable_);
      RC_ASSERT(projector_.now_s - dark_since_s_ <= 0.0501);
    }
  }

  FakeProjector projector_;
  std::shared_ptr<bool> is_dead_;
  std::unique_ptr<acquire::LaserFeeder> feeder_;
  bool allowed_ = false;  // it was armed, and nothing ended that
  bool may_be_lit_ = false;
  double dark_since_s_ = 0;
  bool reachable_ = true;
  bool was_lit_ = false;
};

TEST(LaserFeederProperty, NoSequenceLeavesLightOn) {
  setenv("RC_PARAMS", "seed=20261122 max_success=10000 max_size=60 noshrink=0", 1);
  int lit = 0;
  const bool holds = rc::check("10,000 sequences", [&lit] {
    using Choice = std::pair<int, int>;
    const auto choices = *rc::gen::container<std::vector<Choice>>(
        rc::gen::resize(  // of the sequence, not of what it is made of
            rc::kNominalSize,
            rc::gen::pair(rc::gen::inRange(0, 100), rc::gen::inRange(0, 101))));
    Scene scene;
    for (const auto& [what, share] : choices) {
      // Light is to be there often enough for something to go wrong.
      const int last = static_cast<int>(Act::kEnd);
      const Act act = what < last        ? static_cast<Act>(what)
                      : what < last + 40 ? Act::kStep
                      : what < last + 60 ? Act::kArm
                                         : Act::kShow;
      scene.Do(act, 0.01 * share);
    }
    lit += scene.was_lit() ? 1 : 0;
  });
  EXPECT_TRUE(holds);
  EXPECT_GT(lit, 3000);  // the sequences do light it
}

TEST(LaserFeeder, AFrameThatMayBeLateCountsAndOneInTimeDoesNot) {
  FakeProjector projector;
  const auto alive = std::make_shared<bool>(false);
  acquire::LaserFeeder feeder(
      {.limits = Limits(),
       .dark = acquire::MakeDarkFrame(kPointsPerS),
       .reconnect_s = 1,
       .open = [&] { return std::make_unique<FakeDac>(projector, alive); },
       .clock_s = [&] { return projector.now_s; }});
  feeder.Arm();
  feeder.Show(Frame(5));
  const auto run = [&](double pause_s, int steps) {
    for (int k = 0; k < steps; ++k) {
      projector.Advance(pause_s);
      feeder.Step();
    }
  };
  run(0.001, 10);
  ASSERT_TRUE(feeder.IsSteady());
  run(0.001, 1000);
  EXPECT_EQ(feeder.CountInterruptions(), 0);
  EXPECT_GE(projector.writes, 50);
  EXPECT_LE(projector.writes, 53);
  projector.Advance(0.045);  // all that was sent has ended
  EXPECT_EQ(feeder.CountInterruptions(), 1);
  EXPECT_FALSE(feeder.IsSteady());
  run(0.001, 30);
  EXPECT_TRUE(feeder.IsSteady());
  EXPECT_EQ(feeder.CountInterruptions(), 1);
}

}  // namespace
}  // namespace nacre::testing
