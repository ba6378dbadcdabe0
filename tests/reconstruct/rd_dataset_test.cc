// The dataset file: what is written is what is read, and nothing else is believed.

#include "reconstruct/rd_dataset.h"

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/random.h"
#include "tests/reconstruct/datasets.h"
#include "tests/support/temp_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <numeric>

namespace nacre::reconstruct {
namespace {

using ::testing::HasSubstr;
using testing::RandomDataset;
using testing::RandomHeader;

std::string Bytes(const std::filesystem::path& path) {
  return ReadFile(path);
}

TEST(RdDataset, GridAndOffsetsAreInMillimetresWithRowZeroOnTop) {
  RdHeader header;
  header.points_x = 4;
  header.points_y = 3;
  header.core = 5;
  header.pitch_mm = 0.5;
  EXPECT_EQ(header.GridPoint(0, 0).x, -0.75);
  EXPECT_EQ(header.GridPoint(0, 0).y, 0.5);
  EXPECT_EQ(header.GridPoint(3, 2).x, 0.75);
  EXPECT_EQ(header.GridPoint(3, 2).y, -0.5);
  EXPECT_EQ(header.Offset(2, 2).x, 0.0);
  EXPECT_EQ(header.Offset(0, 0).x, -1.0);
  EXPECT_EQ(header.Offset(0, 0).y, 1.0);
}

TEST(RdDataset, RoundTripsBitForBitAtRandomSizes) {
  const testing::TempFolder folder;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const RdDataset dataset = RandomDataset(RandomHeader(seed), seed);
    const auto path = folder / "x.rd.exr";
    WriteDataset(path, dataset);
    const RdDataset read = ReadDataset(path);
    EXPECT_EQ(read.header.points_x, dataset.header.points_x);
    EXPECT_EQ(read.header.points_y, dataset.header.points_y);
    EXPECT_EQ(read.header.core, dataset.header.core);
    EXPECT_EQ(read.header.pitch_mm, dataset.header.pitch_mm);
    EXPECT_EQ(read.header.eta, dataset.header.eta);
    EXPECT_EQ(read.header.channels, dataset.header.channels);
    EXPECT_EQ(read.header.provenance, dataset.header.provenance);
    EXPECT_EQ(read.rd, dataset.rd) << "seed " << seed;
    EXPECT_EQ(read.sigma, dataset.sigma) << "seed " << seed;
    EXPECT_EQ(read.valid, dataset.valid) << "seed " << seed;
  }
}

TEST(RdDataset, OneSliceIsReadAlone) {
  const testing::TempFolder folder;
  const RdDataset dataset = RandomDataset(RandomHeader(3), 3);
  WriteDataset(folder / "x.rd.exr", dataset);
  RdReader reader(folder / "x.rd.exr");
  const int i = dataset.header.points_x - 1;
  const int j = dataset.header.points_y - 1;
  const RdSlice slice = reader.ReadSlice(i, j);
  const std::ptrdiff_t size = dataset.header.SliceSize();
  EXPECT_TRUE(std::equal(slice.rd.begin(), slice.rd.end(), dataset.rd.end() - size));
}

TEST(RdDataset, SlicesThatPackAndThoseThatDoNotAreReadInAnyOrder) {
  const testing::TempFolder folder;
  RdHeader header = RandomHeader(4);
  header.points_x = 6;
  header.points_y = 5;
  RdDataset dataset = RandomDataset(header, 4);
  const std::ptrdiff_t size = header.SliceSize();
  for (std::ptrdiff_t s = 0; s < header.PointCount(); ++s) {
    if (s % 3 != 0) {  // one of two constants, and every other sigma unknown
      std::fill_n(dataset.rd.begin() + s * size, size, s % 3 == 1 ? 0.5F : 0.25F);
      std::fill_n(dataset.sigma.begin() + s * size, size, s % 2 == 0 ? 0.0F : 1e-6F);
    }
  }
  WriteDataset(folder / "x.rd.exr", dataset);
  RdReader reader(folder / "x.rd.exr");
  for (std::int64_t k = 0; k < 7 * header.PointCount(); ++k) {
    const std::int64_t s = k * k % header.PointCount();
    const RdSlice slice = reader.ReadSlice(static_cast<int>(s % header.points_x),
                                           static_cast<int>(s / header.points_x));
    const RdSlice expected = testing::SliceOf(dataset, s);
    EXPECT_EQ(slice.rd, expected.rd) << s;
    EXPECT_EQ(slice.sigma, expected.sigma) << s;
    EXPECT_EQ(slice.valid, expected.valid) << s;
  }
}

TEST(RdDataset, BytesDoNotDependOnTheOrderOfWriting) {
  const testing::TempFolder folder;
  RdHeader header = RandomHeader(5);
  header.points_x = 5;
  header.points_y = 4;
  const RdDataset dataset = RandomDataset(header, 5);
  WriteDataset(folder / "a.rd.exr", dataset);
  RdWriter writer(folder / "b.rd.exr", header);
  for (std::int64_t k = 0; k < header.PointCount(); ++k) {
    const std::int64_t s = (k * 7 + 13) % header.PointCount();
    writer.WriteSlice(static_cast<int>(s % header.points_x),
                      static_cast<int>(s / header.points_x),
                      testing::SliceOf(dataset, s));
  }
  EXPECT_FALSE(std::filesystem::exists(folder / "b.rd.exr"));
  writer.Finish();
  EXPECT_EQ(Bytes(folder / "a.rd.exr"), Bytes(folder / "b.rd.exr"));
}

TEST(RdDataset, AnUnfinishedWriterLeavesNothing) {
  const testing::TempFolder folder;
  const RdDataset dataset = RandomDataset(RandomHeader(2), 2);
  {
    RdWriter writer(folder / "x.rd.exr", dataset.header);
    writer.WriteSlice(0, 0, testing::SliceOf(dataset, 0));
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(RdDataset, MisuseIsABug) {
  const testing::TempFolder folder;
  RdHeader header = RandomHeader(2);
  header.points_x = 2;
  const RdSlice slice = MakeSlice(header);
  RdWriter writer(folder / "x.rd.exr", header);
  EXPECT_THROW(writer.Finish(), LogicError);
  writer.WriteSlice(0, 0, slice);
  EXPECT_THROW(writer.WriteSlice(0, 0, slice), LogicError);
  EXPECT_THROW(writer.WriteSlice(2, 0, slice), LogicError);
  EXPECT_THROW(writer.WriteSlice(1, 0, RdSlice{}), LogicError);
}

TEST(RdDataset, RefusesToWriteWhatIsNotANumber) {
  const testing::TempFolder folder;
  const RdHeader header = RandomHeader(2);
  RdSlice slice = MakeSlice(header);
  slice.rd.back() = std::numeric_limits<float>::quiet_NaN();
  RdWriter writer(folder / "x.rd.exr", header);
  try {
    writer.WriteSlice(0, 0, slice);
    FAIL();
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), HasSubstr("slice (0, 0) holds a NaN"));
    EXPECT_EQ(e.code(), ExitCode::kBadData);
  }
}

TEST(RdDataset, HeadersThatMakeNoSenseAreNamed) {
  const auto message = [](auto change) -> std::string {
    RdHeader header = RandomHeader(1);
    change(header);
    try {
      Validate(header, "file");
    } catch (const Error& e) {
      return e.what();
    }
    return "no error";
  };
  EXPECT_THAT(message([](RdHeader& h) { h.points_x = 0; }), HasSubstr("points_x is 0"));
  EXPECT_THAT(message([](RdHeader& h) { h.points_y = -1; }), HasSubstr("points_y"));
  EXPECT_THAT(message([](RdHeader& h) { h.core = 4; }),
              HasSubstr("core is 4, not odd"));
  EXPECT_THAT(message([](RdHeader& h) {
                h.core = 4095;
                h.points_x = 1 << 20;
              }),
              HasSubstr("too large"));
  EXPECT_THAT(message([](RdHeader& h) { h.pitch_mm = 0; }), HasSubstr("pitch_mm"));
  EXPECT_THAT(message([](RdHeader& h) { h.pitch_mm = NAN; }), HasSubstr("pitch_mm"));
  EXPECT_THAT(message([](RdHeader& h) { h.eta = 0.5; }), HasSubstr("eta"));
  EXPECT_THAT(message([](RdHeader& h) { h.channels.clear(); }), HasSubstr("channels"));
  EXPECT_THAT(message([](RdHeader& h) { h.channels = {""}; }), HasSubstr("characters"));
  EXPECT_THAT(message([](RdHeader& h) {
                h.channels = {"R", "R"};
              }),
              HasSubstr("'R' is named twice"));
}

TEST(RdDataset, AbsentOrForeignFilesAreErrors) {
  const testing::TempFolder folder;
  EXPECT_THROW(RdReader(folder / "none.rd.exr"), Error);
  WriteFile(folder / "text.rd.exr", "not a picture");
  EXPECT_THROW(RdReader(folder / "text.rd.exr"), Error);
  WriteFile(folder / "empty.rd.exr", "");
  EXPECT_THROW(RdReader(folder / "empty.rd.exr"), Error);
}

// Reads a whole file; true if that worked.
bool Readable(const std::filesystem::path& path, RdDataset* dataset = nullptr) {
  try {
    RdDataset read = ReadDataset(path);
    if (dataset != nullptr) {
      *dataset = std::move(read);
    }
    return true;
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::kBadData) << e.what();
    return false;
  }
}

TEST(RdDataset, EveryTruncationIsFound) {
  const testing::TempFolder folder;
  RdHeader header = RandomHeader(4);
  header.points_x = 3;
  header.points_y = 2;
  WriteDataset(folder / "x.rd.exr", RandomDataset(header, 4));
  const std::string bytes = Bytes(folder / "x.rd.exr");
  const std::size_t step = std::max<std::size_t>(1, bytes.size() / 300);
  for (std::size_t size = 0; size < bytes.size(); size += step) {
    std::ofstream(folder / "y.rd.exr", std::ios::binary) << bytes.substr(0, size);
    EXPECT_FALSE(Readable(folder / "y.rd.exr")) << size << " of " << bytes.size();
  }
}

// A flipped bit is an error, or lies where it changes nothing that a reader is told
// (a pixel aspect ratio, say).
TEST(RdDataset, NoFlippedBitChangesWhatIsRead) {
  const testing::TempFolder folder;
  RdHeader header = RandomHeader(6);
  header.points_x = 2;
  header.points_y = 2;
  header.core = 3;
  header.channels = {"R"};
  const RdDataset dataset = RandomDataset(header, 6);
  WriteDataset(folder / "x.rd.exr", dataset);
  const std::string bytes = Bytes(folder / "x.rd.exr");
  RandomStream random(7, 0);
  int found = 0;
  int harmless = 0;
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    std::string flipped = bytes;
    flipped[at] = static_cast<char>(flipped[at] ^ (1 << (random() % 8)));
    std::ofstream(folder / "y.rd.exr", std::ios::binary) << flipped;
    RdDataset read;
    if (!Readable(folder / "y.rd.exr", &read)) {
      ++found;
      continue;
    }
    ++harmless;
    ASSERT_EQ(read.rd, dataset.rd) << "byte " << at;
    ASSERT_EQ(read.sigma, dataset.sigma) << "byte " << at;
    ASSERT_EQ(read.valid, dataset.valid) << "byte " << at;
    ASSERT_EQ(read.header.pitch_mm, dataset.header.pitch_mm) << "byte " << at;
    ASSERT_EQ(read.header.eta, dataset.header.eta) << "byte " << at;
    ASSERT_EQ(read.header.channels, dataset.header.channels) << "byte " << at;
    ASSERT_EQ(read.header.provenance, dataset.header.provenance) << "byte " << at;
  }
  EXPECT_GT(found, harmless);
}

// Overwrites the 32-bit number that follows an attribute's name, type and size.
std::string WithAttribute(std::string bytes,
                          const std::string& key,
                          std::int32_t value) {
  for (std::size_t at = bytes.find(key); at != std::string::npos;
       at = bytes.find(key, at + 1)) {
    const std::size_t type = at + key.size() + 1;
    const std::size_t data = bytes.find('\0', type) + 1 + 4;
    std::memcpy(&bytes[data], &value, sizeof(value));
  }
  return bytes;
}

TEST(RdDataset, HostileSizesAreRefusedBeforeMemoryIsTaken) {
  const testing::TempFolder folder;
  RdHeader header = RandomHeader(4);
  header.core = 3;
  WriteDataset(folder / "x.rd.exr", RandomDataset(header, 4));
  const std::string bytes = Bytes(folder / "x.rd.exr");
  const auto message = [&](const std::string& key, std::int32_t value) -> std::string {
    WriteFile(folder / "y.rd.exr", WithAttribute(bytes, key, value));
    try {
      const RdReader reader(folder / "y.rd.exr");
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ExitCode::kBadData);
      return e.what();
    }
    return "no error";
  };
  EXPECT_THAT(message("nacre.core", 4001), HasSubstr("core (4001)"));
  EXPECT_THAT(message("nacre.points", 100000), HasSubstr("points (100000"));
  EXPECT_THAT(message("nacre.points", -4), HasSubstr("points_x is -4"));
  EXPECT_THAT(message("nacre.core", 2147483647), HasSubstr("core is 2147483647"));
  EXPECT_THAT(message("nacre.core", 5), HasSubstr("data window"));
}

}  // namespace
}  // namespace nacre::reconstruct
