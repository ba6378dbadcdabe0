// Gaussian profile files: both ways, and every way a file can lie.

#include "factor/sss.h"

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/random.h"
#include "factor/factor.h"
#include "reconstruct/rd_dataset.h"
#include "tests/factor/synthetic.h"
#include "tests/support/temp_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <numbers>

namespace nacre::factor {
namespace {

using nacre::testing::TempFolder;
using ::testing::AllOf;
using ::testing::HasSubstr;

// Assembled by hand from the description of the layout, apart from our encoder.
std::string SssBytes(const std::vector<std::uint32_t>& head,
                     const std::vector<double>& values) {
  std::string bytes;
  const auto put = [&](std::uint64_t word, int count) {
    for (int b = 0; b < count; ++b) {
      bytes += static_cast<char>(word >> (8 * b));
    }
  };
  for (const std::uint32_t size : head) {
    put(size, 4);
  }
  for (const double value : values) {
    put(std::bit_cast<std::uint64_t>(value), 8);
  }
  return bytes;
}

// 3 × 2 points, two Gaussians, window 5.
const std::vector<std::uint32_t> kHead{3, 2, 2, 5};

std::vector<double> GoodValues() {
  RandomStream random(1, 0);
  std::vector<double> values;
  for (int n = 0; n < 3 * 2 * 2 * 3; ++n) {
    values.push_back(static_cast<double>(static_cast<float>(random.Uniform())));
  }
  for (const double beta : {0.5, 0.4, 0.3, 0.05, 0.04, 0.03}) {
    values.push_back(beta);
  }
  return values;
}

constexpr SssOptions kOptions{.pitch_mm = 0.5, .eta = 1.4};

std::string Complaint(const TempFolder& folder, const std::string& bytes) {
  WriteFile(folder / "in.sss", bytes);
  try {
    ReadSss(folder / "in.sss", kOptions);
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::kBadData) << e.what();
    EXPECT_THAT(e.what(), HasSubstr("in.sss"));
    return e.what();
  }
  return "none";
}

TEST(Sss, AProfileIsWhatTheLayoutSays) {
  const TempFolder folder;
  const std::vector<double> values = GoodValues();
  WriteFile(folder / "in.sss", SssBytes(kHead, values));
  const Material m = ReadSss(folder / "in.sss", kOptions);
  EXPECT_EQ(m.points_x, 3);
  EXPECT_EQ(m.points_y, 2);
  EXPECT_EQ(m.core, 5);
  EXPECT_EQ(m.pitch_mm, 0.5);
  // From the file's x = 1, y = 0, the lower row, to x = 2, y = 1: one cell to the right
  // and one up. Green.
  const auto profile = [&](std::size_t x, std::size_t y) {
    double sum = 0;
    for (std::size_t h = 0; h < 2; ++h) {
      const double beta = values[36 + h * 3 + 1];
      sum += values[(y * 3 + x) * 6 + h * 3 + 1] * beta / (2 * std::numbers::pi) *
             std::exp(-beta * 2 / 2);
    }
    return sum;
  };
  const double expected = std::sqrt(profile(1, 0) * profile(2, 1)) / 0.25;
  EXPECT_NEAR(
      static_cast<double>(m.Evaluate(1, 1, 1, 3, 1)), expected, 1e-6 * expected);
}

TEST(Sss, ReadAndWrittenIsTheSameFile) {
  const TempFolder folder;
  const std::vector<double> values = GoodValues();
  WriteFile(folder / "in.sss", SssBytes(kHead, values));
  const Material m = ReadSss(folder / "in.sss", kOptions);
  EXPECT_EQ(WriteSss(folder / "out.sss", m),
            static_cast<std::int64_t>(SssBytes(kHead, values).size()));
  const std::string in = ReadFile(folder / "in.sss");
  const std::string out = ReadFile(folder / "out.sss");
  // Weights that floats hold come back to the bit, β to a float's precision.
  EXPECT_EQ(out.substr(0, 16 + 36 * 8), in.substr(0, 16 + 36 * 8));
  const Material again = ReadSss(folder / "out.sss", kOptions);
  for (std::size_t n = 0; n < m.h.size(); ++n) {
    EXPECT_NEAR(again.h[n], m.h[n], 1e-6F);
  }
}

TEST(Sss, SizesAreCheckedAgainstTheFile) {
  const TempFolder folder;
  const std::string good = SssBytes(kHead, GoodValues());
  EXPECT_THAT(Complaint(folder, ""), HasSubstr("0 bytes"));
  EXPECT_THAT(Complaint(folder, good + "x"), HasSubstr("too long"));
  for (std::size_t size = 16; size < good.size(); size += 29) {
    EXPECT_THAT(Complaint(folder, good.substr(0, size)), HasSubstr("truncated"));
  }
  const auto with = [&](std::size_t word, std::uint32_t value) {
    std::vector<std::uint32_t> head = kHead;
    head[word] = value;
    return SssBytes(head, GoodValues());
  };
  constexpr std::uint32_t kMax = std::numeric_limits<std::uint32_t>::max();
  EXPECT_THAT(Complaint(folder, with(0, 0)), HasSubstr("W is 0"));
  EXPECT_THAT(Complaint(folder, with(1, kMax)), HasSubstr("H is 4294967295"));
  EXPECT_THAT(Complaint(folder, with(0, 1000000)), HasSubstr("truncated"));
  EXPECT_THAT(Complaint(folder, with(2, 65)), HasSubstr("Gaussians"));
  EXPECT_THAT(Complaint(folder, with(3, 4)), HasSubstr("window"));
  EXPECT_THAT(Complaint(folder, with(3, kMax)), HasSubstr("window"));
}

TEST(Sss, ValuesThatAreNoProfileAreNamed) {
  const TempFolder folder;
  const auto with = [&](std::size_t n, double value) {
    std::vector<double> values = GoodValues();
    values[n] = value;
    return SssBytes(kHead, values);
  };
  // x = 2, y = 1, Gaussian 1, blue.
  const auto place = AllOf(HasSubstr("x = 2, y = 1"),
                           HasSubstr("Gaussian 1, channel B"),
                           HasSubstr("byte 296"));
  for (const double bad : {-1.0,
                           1e300,
                           std::numeric_limits<double>::quiet_NaN(),
                           std::numeric_limits<double>::infinity()}) {
    EXPECT_THAT(Complaint(folder, with(35, bad)), place) << bad;
    EXPECT_THAT(Complaint(folder, with(37, bad)),
                AllOf(HasSubstr("beta"), HasSubstr("Gaussian 0, channel G")));
  }
  EXPECT_THAT(Complaint(folder, with(37, 0)), HasSubstr("beta"));
}

TEST(Sss, AnyFlippedBitIsHarmless) {
  const TempFolder folder;
  const std::string good = SssBytes(kHead, GoodValues());
  RandomStream random(3, 0);
  int refused = 0;
  for (int n = 0; n < 400; ++n) {
    std::string damaged = good;
    const auto at =
        static_cast<std::size_t>(random.Uniform() * static_cast<double>(good.size()));
    damaged[at] = static_cast<char>(damaged[at] ^ (1 << (random() % 8)));
    WriteFile(folder / "in.sss", damaged);
    try {
      Validate(ReadSss(folder / "in.sss", kOptions), "damaged");
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ExitCode::kBadData) << e.what();
      ++refused;
    }
  }
  EXPECT_GT(refused, 20);
}

TEST(Sss, SlicesAreTheMaterialAndBeyondTheGridUnknown) {
  const TempFolder folder;
  WriteFile(folder / "in.sss", SssBytes(kHead, GoodValues()));
  const Material m = ReadSss(folder / "in.sss", kOptions);
  const std::int64_t invalid = WriteSlices(folder / "x.rd.exr", m);
  const reconstruct::RdDataset dataset = reconstruct::ReadDataset(folder / "x.rd.exr");
  // All 6 points reach all others.
  EXPECT_EQ(invalid, 3 * (6 * 25 - 36));
  EXPECT_EQ(dataset.Window(4, 1)[1 * 5 + 3], m.Evaluate(1, 1, 1, 3, 1));
  EXPECT_EQ(dataset.header.eta, 1.4);
}

TEST(Sss, OnlyProfilesOfThreeChannelsAreWritten) {
  const TempFolder folder;
  EXPECT_THROW(WriteSss(folder / "x.sss", nacre::testing::MakeMaterial(1)), Error);
  EXPECT_FALSE(std::filesystem::exists(folder / "x.sss"));
  EXPECT_THROW(ReadSss(folder / "none.sss", {.pitch_mm = 0}), Error);
}

TEST(Sss, EqualChannelsAreWrittenThreeTimes) {
  const TempFolder folder;
  reconstruct::RdDataset dataset =
      nacre::testing::MakeChessboard({.points_x = 12, .points_y = 9, .core = 7});
  const std::ptrdiff_t window = dataset.header.WindowSize();
  for (auto slice = dataset.rd.begin(); slice != dataset.rd.end();
       slice += 3 * window) {
    std::copy_n(slice, window, slice + window);
    std::copy_n(slice, window, slice + 2 * window);
  }
  const Material m =
      Factor(dataset, {.method = "profiles", .terms = 3, .bits = 32}).material;
  ASSERT_TRUE(m.is_grey);
  WriteSss(folder / "m.sss", m);
  const Material read =
      ReadSss(folder / "m.sss", {.pitch_mm = m.pitch_mm, .eta = m.eta});
  for (int n = 0; n < 3 * 49; ++n) {
    const float before = m.Evaluate(0, 6, 4, n % 7, n / 7 % 7);
    EXPECT_NEAR(read.Evaluate(n / 49, 6, 4, n % 7, n / 7 % 7) / before, 1, 1e-4F) << n;
  }
}

// What is fitted survives the way through a file, but for what it can't hold.
TEST(Sss, AFitGoesThroughAFile) {
  const TempFolder folder;
  const reconstruct::RdDataset dataset =
      nacre::testing::MakeChessboard({.points_x = 12, .points_y = 9, .core = 7});
  const Material m =
      Factor(dataset, {.method = "profiles", .terms = 3, .bits = 32}).material;
  WriteSss(folder / "m.sss", m);
  const Material read =
      ReadSss(folder / "m.sss", {.pitch_mm = m.pitch_mm, .eta = m.eta});
  for (int cell = 0; cell < 49; ++cell) {
    const float before = m.Evaluate(2, 6, 4, cell % 7, cell / 7);
    EXPECT_NEAR(read.Evaluate(2, 6, 4, cell % 7, cell / 7) / before, 1, 1e-4F);
  }
}

}  // namespace
}  // namespace nacre::factor
