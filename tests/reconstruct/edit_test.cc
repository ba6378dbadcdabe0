#include "reconstruct/edit/edit.h"

#include "core/error.h"
#include "reconstruct/edit/edited_profile.h"
#include "tests/factor/synthetic.h"
#include "tests/support/temp_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

namespace nacre::reconstruct {
namespace {

using ::testing::HasSubstr;
using testing::TempFolder;
using ::testing::ThrowsMessage;

SliceSource SourceOf(const RdDataset& dataset) {
  return {dataset.header, [&dataset](int i, int j) {
            RdSlice slice = MakeSlice(dataset.header);
            const auto size = static_cast<std::size_t>(dataset.header.SliceSize());
            const std::size_t begin =
                static_cast<std::size_t>(j * dataset.header.points_x + i) * size;
            std::copy_n(dataset.rd.begin() + static_cast<std::ptrdiff_t>(begin),
                        size,
                        slice.rd.begin());
            return slice;
          }};
}

class EditTest : public ::testing::Test {
 protected:
  RdDataset Apply(const Edit& edit) {
    summary_ = WriteEdited(source_, edit, "", folder_ / "x.rd.exr", {});
    return ReadDataset(folder_ / "x.rd.exr");
  }
  std::vector<float> Everywhere(double value) const {
    return std::vector<float>(static_cast<std::size_t>(dataset_.header.PointCount()),
                              static_cast<float>(value));
  }
  static double TotalOf(const RdDataset& dataset, std::int64_t slice, int channel) {
    const auto window = dataset.Window(slice, channel);
    return std::accumulate(window.begin(), window.end(), 0.0) *
           dataset.header.CellAreaMm2();
  }
  // √(Σ R |d|² / Σ R), mm.
  static double SpreadOf(const RdDataset& dataset, std::int64_t slice) {
    const auto window = dataset.Window(slice, 0);
    double sum = 0;
    double weight = 0;
    for (int k = 0; k < dataset.header.WindowSize(); ++k) {
      const PointMm d =
          dataset.header.Offset(k % dataset.header.core, k / dataset.header.core);
      const auto value = static_cast<double>(window[static_cast<std::size_t>(k)]);
      sum += value * (d.x * d.x + d.y * d.y);
      weight += value;
    }
    return std::sqrt(sum / weight);
  }
  static void ExpectReciprocal(const RdDataset& dataset, bool periodic) {
    const RdHeader& h = dataset.header;
    const int r = h.Radius();
    int pairs = 0;
    for (int s = 0; s < h.PointCount(); ++s) {
      for (int k = 0; k < h.WindowSize(); ++k) {
        int i = s % h.points_x + k % h.core - r;
        int j = s / h.points_x + k / h.core - r;
        if (periodic) {
          i = (i + h.points_x) % h.points_x;
          j = (j + h.points_y) % h.points_y;
        }
        if (i < 0 || j < 0 || i >= h.points_x || j >= h.points_y) {
          continue;
        }
        const float there = dataset.Window(s, 1)[static_cast<std::size_t>(k)];
        const float back = dataset.Window(
            j * h.points_x + i, 1)[static_cast<std::size_t>(h.WindowSize() - 1 - k)];
        ASSERT_NEAR(static_cast<double>(there),
                    static_cast<double>(back),
                    1e-6 * static_cast<double>(there))
            << s << ' ' << k;
        ++pairs;
      }
    }
    EXPECT_GT(pairs, 1000);
  }

  const RdDataset dataset_ =
      testing::MakeChessboard({.points_x = 16, .points_y = 14, .core = 9});
  const SliceSource source_ = SourceOf(dataset_);
  const TempFolder folder_;
  EditSummary summary_;
};

TEST_F(EditTest, NothingEditedIsTheSameMadeReciprocal) {
  const RdDataset same = Apply({});
  ExpectReciprocal(same, false);
  double off = 0;
  double all = 0;
  for (std::size_t k = 0; k < same.rd.size(); ++k) {
    off += std::pow(static_cast<double>(same.rd[k] - dataset_.rd[k]), 2);
    all += std::pow(static_cast<double>(dataset_.rd[k]), 2);
  }
  EXPECT_LT(std::sqrt(off / all), 2e-3) << "the synthetic sample is nearly reciprocal";
  EXPECT_EQ(summary_.bounded, 0);
}

TEST_F(EditTest, AlbedoScalesTotalsAChannel) {
  const RdDataset same = Apply({});
  const RdDataset edited =
      Apply({.albedo = {Everywhere(0.5), Everywhere(1), Everywhere(1.25)}});
  ExpectReciprocal(edited, false);
  for (const std::int64_t slice : {0, 100, 223}) {
    EXPECT_NEAR(TotalOf(edited, slice, 0) / TotalOf(same, slice, 0), 0.5, 1e-5);
    EXPECT_NEAR(TotalOf(edited, slice, 1) / TotalOf(same, slice, 1), 1, 1e-5);
    EXPECT_NEAR(TotalOf(edited, slice, 2) / TotalOf(same, slice, 2), 1.25, 1e-5);
  }
}

TEST_F(EditTest, NoSliceGivesMoreThanCameIn) {
  const RdDataset edited =
      Apply({.albedo = {Everywhere(100), Everywhere(100), Everywhere(100)}});
  EXPECT_GT(summary_.largest_total, 1);
  EXPECT_GT(summary_.bounded, 0);
  ExpectReciprocal(edited, false);
  double largest = 0;
  for (std::int64_t s = 0; s < edited.header.PointCount(); ++s) {
    largest = std::max(largest, TotalOf(edited, s, 0));
  }
  EXPECT_LE(largest, 1 + 1e-5);
  EXPECT_GT(largest, 0.9);
}

TEST_F(EditTest, AMaskedRangeWidensThereAndOnlyThere) {
  std::vector<float> range = Everywhere(1);
  for (int j = 0; j < 14; ++j) {
    for (int i = 0; i < 3; ++i) {
      range[static_cast<std::size_t>(j * 16 + i)] = 1.6f;
    }
  }
  const RdDataset same = Apply({});
  const RdDataset edited = Apply({.range = range});
  ExpectReciprocal(edited, false);
  const std::int64_t left = 7 * 16 + 1;
  const std::int64_t right = 7 * 16 + 12;
  EXPECT_GT(SpreadOf(edited, left), 1.1 * SpreadOf(same, left));
  EXPECT_NEAR(SpreadOf(edited, right), SpreadOf(same, right), 1e-6);
}

// A Gaussian made s times as wide is a Gaussian; a power of one is one, too.
TEST(EditedProfile, AGaussianStaysOne) {
  RdHeader header;
  header.points_x = 1;
  header.points_y = 1;
  header.core = 31;
  header.pitch_mm = 0.5;
  const auto gaussian = [&](double sigma) {
    Profile profile;
    for (int k = 0; k < header.WindowSize(); ++k) {
      const double r2 = std::pow(k % 31 - 15, 2) + std::pow(k / 31 - 15, 2);
      profile.push_back(static_cast<float>(std::exp(-r2 / (2 * sigma * sigma))));
    }
    return profile;
  };
  const Profile narrow = gaussian(2.5);
  const double total = std::accumulate(narrow.begin(), narrow.end(), 0.0);
  const auto compare = [&](const Profile& edited, double sigma) {
    Profile expected = gaussian(sigma);
    const double sum = std::accumulate(expected.begin(), expected.end(), 0.0);
    EXPECT_NEAR(
        std::accumulate(edited.begin(), edited.end(), 0.0), total, 1e-4 * total);
    for (std::size_t k = 0; k < expected.size(); ++k) {
      EXPECT_NEAR(static_cast<double>(edited[k]),
                  static_cast<double>(expected[k]) * total / sum,
                  0.04 * total / sum)
          << k;
    }
  };
  compare(Stretched(header, narrow, 1.5), 3.75);
  compare(Stretched(header, gaussian(2.5), 0.7), 1.75);
  compare(Reshaped(narrow, 0.5), 2.5 * std::sqrt(2.0));
}

TEST_F(EditTest, MixedHalfAndHalfLiesBetween) {
  const RdDataset constant = testing::MakeConstant(16, 14, 9, 1e-4f);
  RdDataset second = dataset_;
  for (float& value : second.rd) {
    value *= 0.25f;
  }
  const SliceSource other = SourceOf(second);
  const RdDataset same = Apply({});
  const RdDataset mixed = Apply({.other = &other, .mix = Everywhere(0.5)});
  ExpectReciprocal(mixed, false);
  EXPECT_NEAR(TotalOf(mixed, 100, 0) / TotalOf(same, 100, 0), 0.625, 1e-5);
  const SliceSource wrong = SourceOf(constant);
  EXPECT_THAT([&] { Apply({.other = &wrong, .mix = Everywhere(0.5)}); },
              ThrowsMessage<Error>(HasSubstr("different grids")));
}

TEST_F(EditTest, ATileRepeatsWithoutASeam) {
  // A ramp of albedo, whose ends differ by a factor of 3.
  std::vector<float> ramp = Everywhere(1);
  for (std::size_t k = 0; k < ramp.size(); ++k) {
    ramp[k] = 0.5f + static_cast<float>(k % 16) / 15;
  }
  const Edit plain{.albedo = {ramp, ramp, ramp}};
  Edit tiled = plain;
  tiled.tile_overlap = 5;
  const RdDataset tile = Apply(tiled);
  EXPECT_EQ(tile.header.points_x, 11);
  EXPECT_EQ(tile.header.points_y, 9);
  ExpectReciprocal(tile, true);
  // Around the torus, no step in the albedo is larger than within.
  double across = 0;
  double within = 0;
  for (int j = 0; j < 9; ++j) {
    for (int i = 0; i < 11; ++i) {
      const double step = std::abs(TotalOf(tile, j * 11 + i, 0) -
                                   TotalOf(tile, j * 11 + (i + 1) % 11, 0));
      (i == 10 ? across : within) = std::max(i == 10 ? across : within, step);
    }
  }
  EXPECT_LE(across, within);
  tiled.tile_overlap = 9;
  EXPECT_THAT([&] { Apply(tiled); }, ThrowsMessage<Error>(HasSubstr("overlap of 9")));
}

}  // namespace
}  // namespace nacre::reconstruct
