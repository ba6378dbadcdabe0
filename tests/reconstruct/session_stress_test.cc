// Sessions that break naive arithmetic: pictures without light, full to the brim, half
// of either; the smallest grids; any unit. Bounds were set before anything was
// measured.

#include "acquire/session_writer.h"
#include "core/atomic_file.h"
#include "reconstruct/reconstruct.h"
#include "tests/reconstruct/striped_session.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

namespace nacre::reconstruct {
namespace {

constexpr std::uint16_t kFull = 4095;

using ChangePicture = std::function<void(acquire::Frame&)>;

// The session with a grid of its own and other pictures of the sample, which are those
// of the first groups again and again.
acquire::SessionReader Remade(const acquire::SessionReader& original,
                              const std::filesystem::path& folder,
                              const std::string& grid,
                              const ChangePicture& change) {
  std::string text = original.manifest().rig_text;
  const std::string old_grid = "points = [12, 10]\npitch_mm = 1.5\ncore = 9\n";
  text.replace(text.find(old_grid), old_grid.size(), grid.empty() ? old_grid : grid);
  const acquire::SessionManifest manifest =
      acquire::MakeManifest(acquire::ParseRig(text, folder.parent_path() / "rig.toml"),
                            original.manifest().camera,
                            original.manifest().illuminator);
  {
    auto writer = acquire::SessionWriter::Create(folder, manifest, false);
    const std::int64_t begin = original.schedule().grid_begin();
    for (std::int64_t number = 0; number < begin; ++number) {
      writer.Append(original.ReadFrame(number));
    }
    writer.SetScanMap(*original.manifest().scan_map);
    const std::int64_t there = original.schedule().size() - begin;
    for (std::int64_t n = 0; n < writer.schedule().size() - begin; ++n) {
      acquire::Frame frame = original.ReadFrame(begin + n % there);
      change(frame);
      writer.Append(frame);
    }
  }
  return acquire::SessionReader(folder);
}

void FillWith(std::uint16_t counts, acquire::Frame& frame) {
  std::fill(frame.counts.begin(), frame.counts.end(), counts);
}

class ReconstructStressTest : public StripedSession {
 protected:
  struct Result {
    ReconstructSummary summary;
    RdDataset dataset;
  };
  static Result Of(const std::string& name,
                   const ChangePicture& change,
                   const ReconstructOptions& options = {},
                   const std::string& grid = "") {
    std::filesystem::remove_all(Path(name));
    const acquire::SessionReader session = Remade(Session(), Path(name), grid, change);
    calibrate::Calibration calibration = shared->calibration;
    calibration.session_rig_hash = session.manifest().rig_hash;
    const std::filesystem::path out = Path(name + ".rd.exr");
    ReconstructSummary summary = Reconstruct(session, calibration, out, options);
    return {std::move(summary), ReadDataset(out)};  // which refuses what isn't finite
  }
};

TEST_F(ReconstructStressTest, PicturesWithoutLightAreZeroWithinTheirNoise) {
  const auto dark =
      static_cast<std::uint16_t>(std::lround(shared->calibration.dark.Counts(0)));
  for (const bool is_reciprocal : {false, true}) {
    const auto [summary, dataset] =
        Of("dark",
           [&](acquire::Frame& frame) { FillWith(dark, frame); },
           {.symmetrize = is_reciprocal});
    EXPECT_EQ(summary.saturated_count, 0);
    for (std::size_t k = 0; k < dataset.rd.size(); ++k) {
      // Rounded to whole counts, and the dark current left out: within four sigma.
      ASSERT_TRUE(dataset.valid[k] == 0 ||
                  std::abs(dataset.rd[k]) <= 4 * dataset.sigma[k] + 1e-30F)
          << dataset.rd[k] << " +- " << dataset.sigma[k];
    }
  }
}

TEST_F(ReconstructStressTest, CountsOfNothingStayFinite) {
  const auto [summary, dataset] =
      Of("nothing", [](acquire::Frame& frame) { FillWith(0, frame); });
  EXPECT_EQ(summary.slice_count, 120);
  EXPECT_TRUE(std::isfinite(summary.max_crosstalk));
  for (const float rd : dataset.rd) {
    ASSERT_LE(rd, 0);  // the dark level is above
  }
}

TEST_F(ReconstructStressTest, WhatIsFullEverywhereIsNotMeasured) {
  const auto [summary, dataset] =
      Of("full", [](acquire::Frame& frame) { FillWith(kFull, frame); });
  EXPECT_EQ(std::count(dataset.valid.begin(), dataset.valid.end(), 0),
            std::ssize(dataset.valid));
  EXPECT_EQ(summary.invalid_count, std::ssize(dataset.valid));
  EXPECT_EQ(summary.saturated_count,
            summary.group_count * 2 * 200 * 200);  // a merged picture a channel
  EXPECT_TRUE(std::all_of(
      dataset.rd.begin(), dataset.rd.end(), [](float rd) { return rd == 0; }));
}

// Nothing but what is seen goes into a value then, so that it is the same bits.
constexpr ReconstructOptions kPlain{.subtract_crosstalk = false,
                                    .sharpen_spot = false,
                                    .state_systematics = false,
                                    .remove_gloss = false};

TEST_F(ReconstructStressTest, HalvesThatAreFullLeaveTheOthersAlone) {
  const RdDataset plain = Of(
                              "plain", [](acquire::Frame&) {}, kPlain)
                              .dataset;
  const auto [summary, half] = Of(
      "half",
      [](acquire::Frame& frame) {
        for (std::size_t k = 0; k < frame.counts.size(); ++k) {
          if (k % 200 < 100) {
            frame.counts[k] = kFull;
          }
        }
      },
      kPlain);
  EXPECT_GT(summary.invalid_count, std::ssize(half.valid) / 4);
  const RdHeader& header = half.header;
  const std::int64_t window = header.WindowSize();
  int alike = 0;
  for (std::size_t k = 0; k < half.rd.size(); ++k) {
    const auto at = static_cast<std::int64_t>(k);
    const std::int64_t s = at / header.SliceSize();
    const int cell = static_cast<int>(at % window);
    const double x = header.GridPoint(static_cast<int>(s % 12), 0).x +
                     header.Offset(cell % 9, cell / 9).x;
    if (std::abs(x) < 3) {  // the middle of the picture is near the origin
      continue;
    }
    ASSERT_EQ(half.valid[k], x < 0 ? 0 : plain.valid[k]) << x;
    if (x > 0) {
      ASSERT_EQ(half.rd[k], plain.rd[k]);
      ASSERT_EQ(half.sigma[k], plain.sigma[k]);
      ++alike;
    }
  }
  EXPECT_GT(alike, 5000);
  // With tails and all else that is fitted: as good as finite.
  const auto all = Of("half", [](acquire::Frame& frame) {
    for (std::size_t k = 0; k < frame.counts.size(); ++k) {
      if (k % 200 < 100) {
        frame.counts[k] = kFull;
      }
    }
  });
  EXPECT_GT(all.summary.invalid_count, std::ssize(half.valid) / 4);
}

TEST_F(ReconstructStressTest, SmallestGrids) {
  struct Grid {
    const char* text;
    std::int64_t points;
    int core;
  };
  for (const Grid& grid : {Grid{"points = [1, 1]\npitch_mm = 1.5\ncore = 1\n", 1, 1},
                           Grid{"points = [1, 1]\npitch_mm = 1.5\ncore = 9\n", 1, 9},
                           Grid{"points = [12, 1]\npitch_mm = 1.5\ncore = 1\n", 12, 1},
                           Grid{"points = [1, 7]\npitch_mm = 1.5\ncore = 3\n", 7, 3}}) {
    const auto [summary, dataset] = Of(
        "small", [](acquire::Frame&) {}, {.symmetrize = true}, grid.text);
    EXPECT_EQ(summary.slice_count, grid.points);
    EXPECT_EQ(dataset.rd.size(),
              static_cast<std::size_t>(2 * grid.points * grid.core * grid.core));
    EXPECT_EQ(summary.invalid_count, 0) << grid.text;
  }
}

// A unit of R_d changes nothing else: values pass fewer than a hundred roundings of
// which each may be passed on to all, and tails' exponents, of up to a hundred, three:
// 400 u = 2.4·10⁻⁵ of the slice's largest. sigma is a root of sums of squares.
TEST_F(ReconstructStressTest, TheUnitDoesNotMatter) {
  for (const bool symmetrize : {false, true}) {
    // Gloss is measured against the reference, whatever its light is said to be.
    const ReconstructOptions options{
        .remove_gloss = false, .symmetrize = symmetrize, .thread_count = 1};
    Reconstruct(Session(), shared->calibration, Path("u.rd.exr"), options);
    const RdDataset plain = ReadDataset(Path("u.rd.exr"));
    const auto largest = *std::max_element(plain.rd.begin(), plain.rd.end());
    for (const double scale : {1e-30, 1e30}) {
      calibrate::Calibration calibration = shared->calibration;
      for (calibrate::ChannelResponse& channel : calibration.channels) {
        channel.flux_scale_counts_mm2_sr_per_us /= scale;
      }
      Reconstruct(Session(), calibration, Path("s.rd.exr"), options);
      const RdDataset scaled = ReadDataset(Path("s.rd.exr"));
      EXPECT_EQ(scaled.valid, plain.valid);
      for (std::size_t k = 0; k < plain.rd.size(); ++k) {
        ASSERT_NEAR(static_cast<double>(scaled.rd[k]) / scale,
                    static_cast<double>(plain.rd[k]),
                    2.4e-5 * static_cast<double>(largest))
            << scale << ' ' << k;
        ASSERT_NEAR(static_cast<double>(scaled.sigma[k]) / scale,
                    static_cast<double>(plain.sigma[k]),
                    1e-3 * static_cast<double>(plain.sigma[k]))
            << scale << ' ' << k;
      }
    }
  }
}

}  // namespace
}  // namespace nacre::reconstruct
