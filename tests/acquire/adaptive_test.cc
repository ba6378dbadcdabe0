// What an adaptive capture leaves out, on a rig whose scene is known pixel by pixel.

#include "acquire/adaptive.h"

#include "acquire/capture.h"
#include "core/atomic_file.h"
#include "tests/acquire/fake_rig.h"
#include "tests/support/temp_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fmt/format.h>
#include <map>
#include <set>

namespace nacre::acquire {
namespace {

using testing::FakeRig;
using ::testing::HasSubstr;
using testing::IdealScanMap;
using testing::TempFolder;
using testing::TestRig;

constexpr int kDark = 64;

// Three exposures a light: 8000, 1000, 100 µs; spots at least 4 of 7 x 5 cells apart,
// so that the preview lights (0, 0), (4, 0), (0, 4), (4, 4).
RigDescription Rig(const std::string& adaptive = "[adaptive]\n") {
  return TestRig({{"exposures_us = [8000, 1000]", "exposures_us = [8000, 1000, 100]"},
                  {"[schedule]", adaptive + "\n[schedule]"}});
}

// Counts per µs of the pixels that show it.
using Scene = std::function<double(const ScheduledPicture&, const testing::FakeState&)>;

// Pixels 0 to 7 show the scene, 8 to 15 what is as dim as `dim` counts per µs.
constexpr double kDim = 0.002;
void Show(FakeRig& fake,
          const SessionWriter& session,
          const Scene& scene,
          double dim = kDim) {
  fake.camera.edit_frame = [&fake, &session, scene, dim](Frame& frame) {
    const ScheduledPicture& picture =
        session.schedule()[static_cast<std::int64_t>(frame.frame_id)];
    std::fill(frame.counts.begin(), frame.counts.end(), std::uint16_t{kDark});
    if (picture.target == Target::kSample) {
      const double counts = kDark + scene(picture, fake.state) * picture.exposure_us;
      for (std::size_t k = 0; k < 8; ++k) {
        frame.counts[k] = static_cast<std::uint16_t>(std::min(counts, 4095.0));
        frame.counts[k + 8] = static_cast<std::uint16_t>(
            std::min(kDark + dim * picture.exposure_us, 4095.0));
      }
    }
    frame.counts.back() = 4000;  // a hot pixel: bright in the dark too
  };
}

struct Taken {
  CaptureSummary summary;
  std::vector<JournalEntry> entries;
  AdaptivePlan plan;
};

Taken Capture(const RigDescription& rig,
              const Scene& scene,
              double dim = kDim,
              const PixelFromSample& pixel = {},
              const TempFolder& folder = {}) {
  FakeRig fake;
  auto session = SessionWriter::Create(folder / "s", fake.Manifest(rig), false);
  Show(fake, session, scene, dim);
  CaptureCalibration(session, fake.devices());
  CaptureOptions options;
  options.pixel_from_sample = pixel;
  Taken taken;
  taken.summary = CaptureGrid(session, fake.devices(), IdealScanMap(300), {}, options);
  const SessionReader reader(folder / "s");
  EXPECT_TRUE(reader.IsComplete());
  for (std::int64_t k = reader.schedule().grid_begin(); k < reader.picture_count();
       ++k) {
    taken.entries.push_back(reader.Entry(k));
  }
  taken.plan = reader.manifest().adaptive_plan.value_or(AdaptivePlan{});
  return taken;
}

// Exposures taken of a light, after the preview: a digit for each of the three.
std::string Pattern(const Taken& taken, int channel) {
  std::set<std::string> patterns;
  std::map<int, std::string> of_group;
  for (const JournalEntry& entry : taken.entries) {
    if (entry.picture.channel == channel && entry.picture.group > 0) {
      of_group[entry.picture.group] += entry.taken() ? '1' : '0';
    }
  }
  for (const auto& [group, pattern] : of_group) {
    patterns.insert(pattern);
  }
  return fmt::format("{}", fmt::join(patterns, " "));
}

TEST(Adaptive, WithoutTheTableEveryPictureIsTaken) {
  const Taken taken = Capture(Rig(""), [](const auto&, const auto&) { return 0.0; });
  EXPECT_EQ(taken.summary.pictures_skipped, 0);
  EXPECT_EQ(Pattern(taken, 0), "111");
}

TEST(Adaptive, ShorterExposuresOfWhatIsntBrightAreLeftOut) {
  // At 0.4 counts per µs 8000 µs give 3264 of 4095: not bright. At 0.6 they are cut off
  // and 1000 µs are not; at 6, only 100 µs aren't.
  const auto scene = [](const ScheduledPicture& picture, const auto&) {
    return picture.channel == 0 ? 0.4 : picture.group % 2 == 0 ? 0.6 : 6.0;
  };
  const Taken taken = Capture(Rig(), scene);
  EXPECT_EQ(Pattern(taken, 0), "100");
  EXPECT_EQ(Pattern(taken, 1), "110 111");
  EXPECT_EQ(taken.plan.omitted_exposures, (std::vector<int>{0, 0}));
  const auto skipped = std::find_if(taken.entries.begin(),
                                    taken.entries.end(),
                                    [](const auto& entry) { return !entry.taken(); });
  ASSERT_NE(skipped, taken.entries.end());
  EXPECT_THAT(
      skipped->skipped,
      HasSubstr(fmt::format("nothing is bright in picture {}", skipped->number - 1)));
  EXPECT_GT(skipped->picture.group, 0) << "the preview is taken in full";
}

TEST(Adaptive, LongerExposuresThatShowNoPixelMoreAreLeftOut) {
  // Bright as day: 1000 and 100 µs show every pixel that 8000 µs show.
  const Taken taken = Capture(
      Rig(), [](const auto&, const auto&) { return 10.0; }, 10);
  EXPECT_EQ(taken.plan.omitted_exposures, (std::vector<int>{2, 2}));
  EXPECT_EQ(Pattern(taken, 0), "001");
}

TEST(Adaptive, PointsAroundWhichNothingScattersAreNotLit) {
  // Only the spots on the left half scatter.
  const auto scene = [](const ScheduledPicture&, const testing::FakeState& state) {
    bool left = false;
    for (const ScanAngle& spot : state.spots) {
      left = left || spot.x_rad < 0;
    }
    return left ? 0.1 : 0.0;
  };
  // The camera sees the left half in its first pixels, where the scene is.
  const auto pixel = [](PointMm p) {
    const bool is_left = p.x < -0.5;
    const double x = p.x < (is_left ? -1.5 : 0.5) ? 0.0 : 4.0;
    return std::pair(x, is_left ? 0.0 : p.y > 0 ? 2.0 : 3.0);
  };
  const RigDescription rig = Rig();
  const Taken taken = Capture(rig, scene, 0, pixel);
  ASSERT_FALSE(taken.plan.empty_points.empty());
  for (const GridIndex& point : taken.plan.empty_points) {
    EXPECT_GE(point.i, 4) << "between lit and empty spots nothing is left out";
  }
  for (const JournalEntry& entry : taken.entries) {
    for (const GridIndex& spot : entry.spots) {
      EXPECT_EQ(
          std::count(
              taken.plan.empty_points.begin(), taken.plan.empty_points.end(), spot),
          0);
    }
    EXPECT_TRUE(!entry.spots.empty() || !entry.taken());
  }
}

TEST(Adaptive, InterruptedAnywhereAndResumedIsTheSame) {
  const auto scene = [](const ScheduledPicture& picture, const auto&) {
    return picture.channel == 0 ? 0.4 : 0.6;
  };
  const TempFolder whole;
  Capture(Rig(), scene, kDim, {}, whole);
  const std::string expected = ReadFile(whole / "s" / "journal");
  for (const std::int64_t stop : {30, 34, 35, 36, 41, 60}) {
    const TempFolder folder;
    FakeRig fake;
    for (const bool resumed : {false, true}) {
      auto session =
          resumed ? SessionWriter::Resume(folder / "s", fake.Manifest(Rig()), false)
                  : SessionWriter::Create(folder / "s", fake.Manifest(Rig()), false);
      Show(fake, session, scene);
      try {
        CaptureCalibration(session, fake.devices());
        CaptureGrid(session, fake.devices(), IdealScanMap(300), [&](const Progress& p) {
          return resumed || p.done < stop;
        });
        EXPECT_TRUE(resumed);
      } catch (const Error& e) {
        EXPECT_EQ(e.code(), ExitCode::kInterrupted);
      }
    }
    EXPECT_EQ(ReadFile(folder / "s" / "journal"), expected) << stop;
    EXPECT_EQ(ReadFile(folder / "s" / "session.json"),
              ReadFile(whole / "s" / "session.json"));
  }
}

TEST(Adaptive, ASkippedPictureCantBeRead) {
  const TempFolder folder;
  Capture(
      Rig(), [](const auto&, const auto&) { return 0.4; }, kDim, {}, folder);
  const SessionReader session(folder / "s");
  for (std::int64_t k = session.schedule().grid_begin(); k < session.picture_count();
       ++k) {
    if (!session.WasTaken(k)) {
      try {
        session.ReadFrame(k);
        FAIL();
      } catch (const Error& e) {
        EXPECT_THAT(e.what(), HasSubstr("was left out: nothing is bright"));
      }
      return;
    }
  }
  FAIL() << "none was skipped";
}

TEST(Outline, PointsOutsideAreInNoGroup) {
  const RigDescription rig = TestRig(
      {{"core = 3", "core = 3\noutline_mm = [-0.8, -5, 0.8, -5, 0.8, 5, -0.8, 5]"}});
  const Schedule schedule(rig);
  std::set<int> columns;
  std::size_t points = 0;
  for (int group = 0; group < schedule.group_count(); ++group) {
    EXPECT_FALSE(schedule.Group(group).empty());
    for (const GridIndex& point : schedule.Group(group)) {
      columns.insert(point.i);
      ++points;
    }
  }
  EXPECT_EQ(columns, (std::set<int>{2, 3, 4}));  // x of -0.5, 0, 0.5 mm
  EXPECT_EQ(points, 15U);
}

TEST(Outline, MistakesAreNamed) {
  const auto message = [](const std::string& outline) {
    try {
      TestRig({{"core = 3", "core = 3\noutline_mm = " + outline}});
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string("no error");
  };
  EXPECT_THAT(message("[0, 0, 1, 1]"), HasSubstr("three corners or more"));
  EXPECT_THAT(message("[50, 50, 51, 50, 51, 51]"),
              HasSubstr("no grid point lies inside"));
}

}  // namespace
}  // namespace nacre::acquire
