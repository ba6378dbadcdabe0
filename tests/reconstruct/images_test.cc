// Folders of pictures, one a grid point.

#include "reconstruct/import/images.h"

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/exr.h"
#include "core/png.h"
#include "reconstruct/import/pfm.h"
#include "tests/reconstruct/datasets.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <fmt/format.h>
#include <limits>

namespace nacre::reconstruct {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::TempFolder;

// Value at pixel (x, y) of picture (i, j), channel c: all different.
float ValueAt(int i, int j, int c, int x, int y) {
  return static_cast<float>((((i * 10 + j) * 3 + c) * 100 + y) * 100 + x + 1);
}

ExrPart Picture(int i, int j, int width, int height) {
  ExrPart part;
  part.width = width;
  part.height = height;
  part.channels = {"R", "G", "B"};
  for (int c = 0; c < 3; ++c) {
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        part.values.push_back(ValueAt(i, j, c, x, y));
      }
    }
  }
  return part;
}

void WritePictures(
    const TempFolder& folder, int columns, int rows, int size, int first) {
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      WriteExr(folder / fmt::format("scan_{:04}_{:04}.exr", i + first, j + first),
               {Picture(i, j, size, size)});
    }
  }
}

ImportOptions Options() {
  return {.pitch_mm = 0.5};
}

std::string ImportError(const TempFolder& folder, const ImageImportOptions& options) {
  try {
    ImportImages(folder.path(), folder / "x.rd.exr", Options(), options);
  } catch (const Error& e) {
    return e.what();
  }
  return "no error";
}

TEST(Images, WindowsAreTakenAsTheyAre) {
  const TempFolder folder;
  WritePictures(folder, 3, 2, 5, 1);
  ImportImages(folder.path(),
               folder / "x.rd.exr",
               Options(),
               {.pattern = "scan_{i}_{j}.exr", .first = 1});
  const RdDataset dataset = ReadDataset(folder / "x.rd.exr");
  EXPECT_EQ(dataset.header.points_x, 3);
  EXPECT_EQ(dataset.header.points_y, 2);
  EXPECT_EQ(dataset.header.core, 5);
  EXPECT_EQ(dataset.Window(1 * 3 + 2, 1)[4 * 5 + 3], ValueAt(2, 1, 1, 3, 4));
}

TEST(Images, WindowsAreCutFromFramesAndMarkedWhereFramesEnd) {
  const TempFolder folder;
  WritePictures(folder, 3, 1, 7, 0);
  const ImportSummary summary =
      ImportImages(folder.path(), folder / "x.rd.exr", Options(), {.core = 5});
  const RdDataset dataset = ReadDataset(folder / "x.rd.exr");
  // 3 points centred on 7 pixels: point 0 at x = 2; windows reach 2 cells each way.
  EXPECT_EQ(dataset.Window(0, 0)[2 * 5 + 2], ValueAt(0, 0, 0, 2, 3));
  EXPECT_EQ(dataset.Window(2, 0)[2 * 5 + 4], ValueAt(2, 0, 0, 6, 3));
  EXPECT_EQ(summary.invalid_count, 0);

  const ImportSummary wide =
      ImportImages(folder.path(), folder / "y.rd.exr", Options(), {.core = 7});
  const RdDataset cut = ReadDataset(folder / "y.rd.exr");
  EXPECT_EQ(wide.invalid_count, 2 * 7 * 3);  // one column each at both ends
  EXPECT_EQ(cut.valid[0], 0);
  EXPECT_EQ(cut.valid[1], 1);
  EXPECT_EQ(cut.rd[0], 0.0F);
}

TEST(Images, Png16IsLinearAndScaled) {
  const TempFolder folder;
  PngImage image;
  image.width = 1;
  image.height = 1;
  image.channel_count = 1;
  image.bit_depth = 16;
  image.values = {13107};  // a fifth of 65535
  WritePng(folder / "a_0_0.png", image);
  ImportOptions options = Options();
  options.scale = 10;
  ImportImages(folder.path(), folder / "x.rd.exr", options, {});
  const RdDataset dataset = ReadDataset(folder / "x.rd.exr");
  EXPECT_EQ(dataset.header.channels, std::vector<std::string>{"Y"});
  EXPECT_FLOAT_EQ(dataset.rd[0], 2.0F);
}

std::string PfmBytes(bool little) {
  // 2 × 2, one channel; PFM's first row is the bottom one.
  std::string bytes = little ? "Pf\n2 2\n-1.0\n" : "Pf\n2 2\n1.0\n";
  for (const float value : {3.0F, 4.0F, 1.0F, 2.0F}) {
    const auto bits = std::bit_cast<std::uint32_t>(value);
    for (int b = 0; b < 4; ++b) {
      bytes += static_cast<char>(bits >> (8 * (little ? b : 3 - b)));
    }
  }
  return bytes;
}

TEST(Images, PfmOfEitherByteOrderIsTurnedUpright) {
  const TempFolder folder;
  for (const bool little : {true, false}) {
    WriteFile(folder / "a.pfm", PfmBytes(little));
    const ExrPart part = ReadPfm(folder / "a.pfm");
    EXPECT_EQ(part.values, (std::vector<float>{1, 2, 3, 4}));
  }
}

TEST(Images, PfmThatLiesIsRefused) {
  const TempFolder folder;
  const auto message = [&](const std::string& bytes) -> std::string {
    WriteFile(folder / "a.pfm", bytes);
    try {
      ReadPfm(folder / "a.pfm");
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ExitCode::kBadData);
      return e.what();
    }
    return "no error";
  };
  const std::string good = PfmBytes(true);
  for (std::size_t size = 0; size < good.size(); ++size) {
    EXPECT_NE(message(good.substr(0, size)), "no error") << size;
  }
  EXPECT_THAT(message(good + "x"), HasSubstr("need 16 bytes, found 17"));
  EXPECT_THAT(message("PF\n2000000000 2000000000\n-1\n"), HasSubstr("need 48"));
  EXPECT_THAT(message("PF\n-2 2\n-1\n"), HasSubstr("width -2"));
  EXPECT_THAT(message("PF\n2 2\nnan\n"), HasSubstr("scale nan"));
  EXPECT_THAT(message("PF\ntwo 2\n1\n"), HasSubstr("the width is 'two'"));
  EXPECT_THAT(message("P6\n2 2\n255\n"), HasSubstr("PF or Pf"));
}

TEST(Images, ErrorsNameWhatIsWrong) {
  const TempFolder empty;
  EXPECT_THAT(ImportError(empty, {}), HasSubstr("no file name fits"));
  EXPECT_THAT(ImportError(empty, {.pattern = "a_{i}.exr"}),
              HasSubstr("{i} and {j} once"));

  const TempFolder holes;
  WritePictures(holes, 2, 2, 3, 0);
  std::filesystem::remove(holes / "scan_0001_0000.exr");
  EXPECT_THAT(ImportError(holes, {}), HasSubstr("none for column 1, row 0"));
  EXPECT_THAT(ImportError(holes, {.first = 1}), HasSubstr("numbered below the first"));

  const TempFolder twice;
  WritePictures(twice, 1, 1, 3, 0);
  WriteExr(twice / "again_0_0.exr", {Picture(0, 0, 3, 3)});
  EXPECT_THAT(ImportError(twice, {}), HasSubstr("both for column 0, row 0"));

  const TempFolder even;
  WritePictures(even, 1, 1, 4, 0);
  EXPECT_THAT(ImportError(even, {}), HasSubstr("square and odd"));
  EXPECT_THAT(ImportError(even, {.core = 3}),
              HasSubstr("both must be odd or both even"));

  const TempFolder sizes;
  WritePictures(sizes, 2, 1, 3, 0);
  WriteExr(sizes / "scan_0001_0000.exr", {Picture(0, 0, 5, 5)});
  EXPECT_THAT(ImportError(sizes, {}), HasSubstr("unlike the other pictures'"));

  const TempFolder nan;
  ExrPart part = Picture(0, 0, 3, 3);
  part.Channel(1)[1 * 3 + 2] = std::numeric_limits<float>::quiet_NaN();
  WriteExr(nan / "a_0_0.exr", {part});
  EXPECT_THAT(ImportError(nan, {}),
              AllOf(HasSubstr("a_0_0.exr"), HasSubstr("pixel (2, 1), channel G")));

  const TempFolder kind;
  WriteFile(kind / "a_0_0.hdr", "#?RADIANCE");
  EXPECT_THAT(ImportError(kind, {}), HasSubstr("convert to .exr"));
}

}  // namespace
}  // namespace nacre::reconstruct
