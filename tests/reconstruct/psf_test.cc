// The raw "psf" layout: bit for bit both ways, and every way a file can lie.

#include "reconstruct/export/psf.h"

#include "core/atomic_file.h"
#include "core/error.h"
#include "reconstruct/import/psf.h"
#include "tests/reconstruct/datasets.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cstring>
#include <limits>

namespace nacre::reconstruct {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::RandomHeader;
using testing::TempFolder;

// Assembled by hand from the description of the layout, apart from our encoder.
std::string PsfBytes(int width, int height, int k, const std::vector<float>& values) {
  std::string bytes;
  const auto put = [&](std::uint32_t word) {
    for (int b = 0; b < 4; ++b) {
      bytes += static_cast<char>(word >> (8 * b));
    }
  };
  for (const int size : {width, height, k, k}) {
    put(static_cast<std::uint32_t>(size));
  }
  for (const float value : values) {
    put(std::bit_cast<std::uint32_t>(value));
  }
  return bytes;
}

std::vector<float> RandomValues(std::size_t count, std::uint64_t seed) {
  RandomStream random(seed, 0);
  std::vector<float> values(count);
  for (float& value : values) {
    value = static_cast<float>(std::pow(10.0, -30 * random.Uniform()));
  }
  return values;
}

ImportOptions PsfOptions() {
  return {.pitch_mm = 0.25, .eta = 1.5};
}

std::string ImportError(const TempFolder& folder,
                        const std::string& bytes,
                        const ImportOptions& options = PsfOptions()) {
  WriteFile(folder / "in.psf", bytes);
  try {
    ImportPsf(folder / "in.psf", folder / "out.rd.exr", options);
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::kBadData) << e.what();
    EXPECT_FALSE(std::filesystem::exists(folder / "out.rd.exr"));
    return e.what();
  }
  return "no error";
}

TEST(Psf, ImportAndExportGiveTheSameBytes) {
  const TempFolder folder;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    RandomStream random(seed, 9);
    const int width = 1 + static_cast<int>(random() % 5);
    const int height = 1 + static_cast<int>(random() % 5);
    const int k = 1 + 2 * static_cast<int>(random() % 4);
    std::vector<float> values =
        RandomValues(static_cast<std::size_t>(width * height * k * k * 3), seed);
    values[0] = -0.0F;
    values.back() = std::numeric_limits<float>::denorm_min();
    const std::string bytes = PsfBytes(width, height, k, values);
    WriteFile(folder / "a.psf", bytes);
    ImportPsf(folder / "a.psf", folder / "a.rd.exr", PsfOptions());
    ExportPsf(folder / "a.rd.exr", folder / "b.psf", {});
    EXPECT_EQ(ReadFile(folder / "b.psf"), bytes) << "seed " << seed;
    ImportPsf(folder / "b.psf", folder / "b.rd.exr", PsfOptions());
    EXPECT_EQ(ReadDataset(folder / "b.rd.exr").rd, ReadDataset(folder / "a.rd.exr").rd);
  }
}

TEST(Psf, RowsAndWindowsAreFlippedIntoPictureOrder) {
  const TempFolder folder;
  const int width = 2;
  const int height = 3;
  const int k = 3;
  std::vector<float> values;
  for (int n = 0; n < width * height * k * k * 3; ++n) {
    values.push_back(static_cast<float>(n));
  }
  WriteFile(folder / "a.psf", PsfBytes(width, height, k, values));
  const ImportSummary summary =
      ImportPsf(folder / "a.psf", folder / "a.rd.exr", PsfOptions());
  EXPECT_EQ(summary.points_x, 2);
  EXPECT_EQ(summary.points_y, 3);
  const RdDataset dataset = ReadDataset(folder / "a.rd.exr");
  EXPECT_EQ(dataset.header.pitch_mm, 0.25);
  EXPECT_EQ(dataset.header.eta, 1.5);
  // Picture x = 1, y = 0 of the file is the lower right: i = 1, j = 2. Its window's
  // kx = 2, ky = 0 is the lower right cell: u = 2, v = 2. Green is second.
  const int record = (0 * width + 1) * k * k * 3;
  const float expected = values[static_cast<std::size_t>(record + (0 * k + 2) * 3 + 1)];
  EXPECT_EQ(dataset.Window(2 * width + 1, 1)[2 * k + 2], expected);
}

TEST(Psf, SizesAreCheckedAgainstTheFileBeforeMemoryIsTaken) {
  const TempFolder folder;
  const std::string good = PsfBytes(2, 2, 3, RandomValues(108, 1));
  EXPECT_THAT(ImportError(folder, ""), HasSubstr("0 bytes, shorter than its header"));
  EXPECT_THAT(ImportError(folder, good + "x"),
              AllOf(HasSubstr("too long"), HasSubstr("448"), HasSubstr("449")));
  for (std::size_t size = 1; size < good.size(); size += 7) {
    const std::string message = ImportError(folder, good.substr(0, size));
    EXPECT_THAT(message, HasSubstr(std::to_string(size)));
    if (size >= 16) {
      EXPECT_THAT(message,
                  AllOf(HasSubstr("truncated"), HasSubstr("448"), HasSubstr("W")));
    }
  }
  const auto with = [&](std::size_t word, std::int32_t value) {
    std::string bytes = good;
    std::memcpy(&bytes[4 * word], &value, 4);
    return bytes;
  };
  constexpr std::int32_t kMax = std::numeric_limits<std::int32_t>::max();
  EXPECT_THAT(ImportError(folder, with(0, -1)), HasSubstr("W is -1"));
  EXPECT_THAT(ImportError(folder, with(1, 0)), HasSubstr("H is 0"));
  EXPECT_THAT(ImportError(folder, with(2, 5)), HasSubstr("kw x kh = 5 x 3"));
  EXPECT_THAT(ImportError(folder, with(0, kMax)), HasSubstr("truncated"));
  std::string huge = good;
  for (const std::size_t word : {0U, 1U, 2U, 3U}) {
    std::memcpy(&huge[4 * word], &kMax, 4);
  }
  EXPECT_THAT(ImportError(folder, huge), HasSubstr("found 448"));
  EXPECT_THAT(ImportError(folder, PsfBytes(1, 1, 2, RandomValues(12, 1))),
              HasSubstr("square and odd"));
}

TEST(Psf, ValuesThatAreNoRdAreNamed) {
  const TempFolder folder;
  const auto with = [&](float value) {
    std::vector<float> values = RandomValues(2 * 2 * 9 * 3, 1);
    // Pixel (1, 0), window (kx, ky) = (2, 1), blue.
    values[27 + (1 * 3 + 2) * 3 + 2] = value;
    return PsfBytes(2, 2, 3, values);
  };
  const auto place = AllOf(HasSubstr("x = 1, y = 0"),
                           HasSubstr("kx = 2, ky = 1"),
                           HasSubstr("channel B"),
                           HasSubstr("byte 192"));
  EXPECT_THAT(ImportError(folder, with(std::numeric_limits<float>::quiet_NaN())),
              place);
  EXPECT_THAT(ImportError(folder, with(std::numeric_limits<float>::infinity())), place);
  EXPECT_THAT(ImportError(folder, with(-1.0F)), place);

  WriteFile(folder / "in.psf", with(-1.0F));
  ImportOptions options = PsfOptions();
  options.clamp_negative = true;
  EXPECT_EQ(ImportPsf(folder / "in.psf", folder / "x.rd.exr", options).clamped_count,
            1);
  // Clamping is for noise: what isn't a number stays an error.
  EXPECT_THAT(
      ImportError(folder, with(-std::numeric_limits<float>::infinity()), options),
      place);
}

TEST(Psf, UnitsAreNotGuessed) {
  const TempFolder folder;
  EXPECT_THAT(ImportError(folder, PsfBytes(1, 1, 1, {1, 1, 1}), {.pitch_mm = 0}),
              HasSubstr("pitch_mm"));
}

TEST(Psf, ExportRefusesWhatTheLayoutCannotSay) {
  const TempFolder folder;
  RdHeader header = RandomHeader(1);
  header.channels = {"R", "G"};
  WriteDataset(folder / "two.rd.exr", testing::RandomDataset(header, 1));
  EXPECT_THROW(ExportPsf(folder / "two.rd.exr", folder / "x.psf", {}), Error);
  header.channels = {"R", "G", "B"};
  RdDataset dataset = testing::RandomDataset(header, 1);
  dataset.rd[0] = -1;
  WriteDataset(folder / "negative.rd.exr", dataset);
  EXPECT_THROW(ExportPsf(folder / "negative.rd.exr", folder / "x.psf", {}), Error);
  EXPECT_FALSE(std::filesystem::exists(folder / "x.psf"));
  const ExportSummary summary =
      ExportPsf(folder / "negative.rd.exr", folder / "x.psf", {.clamp_negative = true});
  EXPECT_GE(summary.clamped_count, 1);
  EXPECT_EQ(static_cast<std::uintmax_t>(summary.bytes),
            std::filesystem::file_size(folder / "x.psf"));
}

}  // namespace
}  // namespace nacre::reconstruct
