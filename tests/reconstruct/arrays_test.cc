// Arrays of NumPy and MATLAB files: axes, types, orders, and files that are damaged.

#include "core/atomic_file.h"
#include "core/error.h"
#include "reconstruct/import/npy.h"
#include "tests/reconstruct/datasets.h"
#include "tests/support/error_message.h"

#ifdef NACRE_HAS_MAT
#include "reconstruct/import/mat.h"

#include <matio.h>
#endif

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <fmt/format.h>

namespace nacre::reconstruct {
namespace {

using nacre::testing::ErrorMessage;
using ::testing::HasSubstr;
using testing::TempFolder;

// 2 rows, 3 columns, windows of 5 x 5, 2 channels, each value different.
constexpr int kY = 2, kX = 3, kCore = 5, kC = 2;
float ArrayValue(int y, int x, int v, int u, int c) {
  return static_cast<float>((((y * 10 + x) * 10 + v) * 10 + u) * 10 + c) * 0.25F;
}

// Values in C order of (y, x, v, u, c).
std::vector<float> Values() {
  std::vector<float> values;
  for (int n = 0; n < kY * kX * kCore * kCore * kC; ++n) {
    values.push_back(ArrayValue(n / (kX * kCore * kCore * kC),
                                n / (kCore * kCore * kC) % kX,
                                n / (kCore * kC) % kCore,
                                n / kC % kCore,
                                n % kC));
  }
  return values;
}

std::string Npy(const std::string& descr,
                const std::string& order,
                const std::string& shape,
                const std::string& numbers,
                int version = 1) {
  std::string text = "{'descr': '" + descr + "', 'fortran_order': " + order +
                     ", 'shape': (" + shape + "), }";
  text.resize((text.size() + 12) / 64 * 64 + 64 - 12, ' ');
  text.back() = '\n';
  std::string file = "\x93NUMPY";
  file += static_cast<char>(version);
  file += '\0';
  for (int byte = 0; byte < (version == 1 ? 2 : 4); ++byte) {
    file += static_cast<char>(text.size() >> (8 * byte));
  }
  return file + text + numbers;
}

template <class Number>
std::string Bytes(const std::vector<Number>& values) {
  std::string bytes(values.size() * sizeof(Number), '\0');
  std::memcpy(bytes.data(), values.data(), bytes.size());
  return bytes;
}

std::string SmallNpy() {
  return Npy("<f4", "False", "2, 3, 5, 5, 2", Bytes(Values()));
}

RdDataset Import(const TempFolder& folder,
                 const std::string& bytes,
                 const ArrayImportOptions& options = {}) {
  WriteFile(folder / "a.npy", bytes);
  ImportNpy(folder / "a.npy", folder / "a.rd.exr", {.pitch_mm = 0.5}, options);
  return ReadDataset(folder / "a.rd.exr");
}

void ExpectValues(const RdDataset& dataset, bool bottom_first = false) {
  const RdHeader& header = dataset.header;
  ASSERT_EQ(header.points_x, kX);
  ASSERT_EQ(header.points_y, kY);
  ASSERT_EQ(header.core, kCore);
  ASSERT_EQ(std::ssize(header.channels), kC);
  std::size_t at = 0;
  for (int y = 0; y < kY; ++y) {
    for (int x = 0; x < kX; ++x) {
      for (int c = 0; c < kC; ++c) {
        for (int v = 0; v < kCore; ++v) {
          for (int u = 0; u < kCore; ++u, ++at) {
            ASSERT_EQ(dataset.rd[at],
                      bottom_first ? ArrayValue(kY - 1 - y, x, kCore - 1 - v, u, c)
                                   : ArrayValue(y, x, v, u, c));
          }
        }
      }
    }
  }
}

TEST(Npy, ReadsEveryOrderAndType) {
  const TempFolder folder;
  ExpectValues(Import(folder, SmallNpy()));
  ExpectValues(Import(folder, Npy("<f4", "False", "2,3, 5, 5, 2", Bytes(Values()), 2)));
  const std::vector<float> values = Values();
  ExpectValues(Import(folder,
                      Npy("<f8",
                          "False",
                          "2, 3, 5, 5, 2",
                          Bytes(std::vector<double>(values.begin(), values.end())))));
  std::string big = Bytes(values);
  for (std::size_t k = 0; k < big.size(); k += 4) {
    std::reverse(big.begin() + static_cast<std::ptrdiff_t>(k),
                 big.begin() + static_cast<std::ptrdiff_t>(k + 4));
  }
  ExpectValues(Import(folder, Npy(">f4", "False", "2, 3, 5, 5, 2", big)));
  // In Fortran's order the same bytes are an array with its axes reversed.
  ExpectValues(Import(
      folder, Npy("<f4", "True", "2, 5, 5, 3, 2", Bytes(values)), {.axes = "cuvxy"}));
  ExpectValues(Import(folder, SmallNpy(), {.bottom_first = true}), true);
}

TEST(Npy, WholeNumbersAndOneChannel) {
  const TempFolder folder;
  const std::vector<std::uint16_t> values = {1, 2, 3, 4, 5, 6, 7, 8, 65535};
  WriteFile(folder / "a.npy", Npy("<u2", "False", "1, 1, 3, 3", Bytes(values)));
  ImportNpy(folder / "a.npy",
            folder / "a.rd.exr",
            {.pitch_mm = 0.5, .scale = 0.5},
            {.channels = "532nm"});
  const RdDataset dataset = ReadDataset(folder / "a.rd.exr");
  EXPECT_EQ(dataset.header.channels, std::vector<std::string>{"532nm"});
  EXPECT_EQ(dataset.rd[8], 32767.5F);
}

TEST(Npy, WhatIsMissingIsAskedForByName) {
  const TempFolder folder;
  const auto message = [&](const std::string& bytes,
                           const ArrayImportOptions& options = {},
                           ExitCode code = ExitCode::kUsage) {
    return ErrorMessage([&] { Import(folder, bytes, options); }, code);
  };
  EXPECT_THAT(message(SmallNpy(), {.axes = "yxvu"}), HasSubstr("has 5 axes"));
  EXPECT_THAT(message(SmallNpy(), {.axes = "yxvvc"}), HasSubstr("has no u"));
  EXPECT_THAT(message(SmallNpy(), {.axes = "cyxvu"}, ExitCode::kBadData),
              HasSubstr("check --axes"));
  EXPECT_THAT(message(SmallNpy(), {.channels = "R,G,B"}), HasSubstr("--channels"));
  EXPECT_THAT(message(Npy("<i4", "False", "1", "1234"), {}, ExitCode::kBadData),
              HasSubstr("astype"));
  EXPECT_THAT(message(Npy("<f4", "False", "9", std::string(36, '\0'))),
              HasSubstr("has 1 axes"));
  WriteFile(folder / "a.npy", SmallNpy());
  EXPECT_THAT(
      ErrorMessage([&] { ImportNpy(folder / "a.npy", folder / "b.rd.exr", {}, {}); }),
      HasSubstr("pitch_mm"));
  std::vector<float> values = Values();
  values[1] = std::nanf("");
  EXPECT_THAT(
      message(
          Npy("<f4", "False", "2, 3, 5, 5, 2", Bytes(values)), {}, ExitCode::kBadData),
      HasSubstr("nan at (y, x, v, u, c) = [0, 0, 0, 0, 1]"));
}

TEST(Npy, TruncatedAndHostileFilesAreRefused) {
  const TempFolder folder;
  const std::string good = SmallNpy();
  for (std::size_t size = 0; size < good.size(); size += size < 150 ? 3 : 197) {
    EXPECT_THROW(Import(folder, good.substr(0, size)), Error) << size;
  }
  EXPECT_THROW(Import(folder, good + "x"), Error);
  for (const char* shape : {"99999999999999, 99999999999999, 5, 5, 2",
                            "9999999999999999999999, 1, 1, 1",
                            "0, 3, 5, 5, 2",
                            "-2, 3, 5, 5, 2",
                            "1,1,1,1,1,1,1,1,1,1,1,1,1,1"}) {
    EXPECT_THROW(Import(folder, Npy("<f4", "False", shape, Bytes(Values()))), Error);
  }
  // A flipped bit of the header gives an error or the same numbers, never a crash.
  for (std::size_t bit = 0; bit < 8 * 128; bit += 11) {
    std::string bad = good;
    bad[bit / 8] = static_cast<char>(bad[bit / 8] ^ (1 << (bit % 8)));
    try {
      Import(folder, bad);
    } catch (const Error&) {
    }
  }
}

#ifdef NACRE_HAS_MAT

// MATLAB's order: the first axis runs fastest.
std::vector<double> MatlabValues() {
  std::vector<double> values;
  for (int n = 0; n < kY * kX * kCore * kCore * kC; ++n) {
    values.push_back(static_cast<double>(ArrayValue(n % kY,
                                                    n / kY % kX,
                                                    n / (kY * kX) % kCore,
                                                    n / (kY * kX * kCore) % kCore,
                                                    n / (kY * kX * kCore * kCore))));
  }
  return values;
}

void WriteMat(const std::filesystem::path& path,
              mat_ft version,
              bool packed,
              int arrays) {
  mat_t* file = Mat_CreateVer(path.c_str(), nullptr, version);
  ASSERT_NE(file, nullptr);
  std::vector<double> values = MatlabValues();
  std::array<std::size_t, 5> dims = {kY, kX, kCore, kCore, kC};
  std::array<std::size_t, 2> one = {1, 1};
  double pitch = 0.5;
  matvar_t* scalar =
      Mat_VarCreate("pitch", MAT_C_DOUBLE, MAT_T_DOUBLE, 2, one.data(), &pitch, 0);
  Mat_VarWrite(file, scalar, MAT_COMPRESSION_NONE);
  Mat_VarFree(scalar);
  for (int n = 0; n < arrays; ++n) {
    matvar_t* array = Mat_VarCreate(fmt::format("rd{}", n).c_str(),
                                    MAT_C_DOUBLE,
                                    MAT_T_DOUBLE,
                                    5,
                                    dims.data(),
                                    values.data(),
                                    0);
    Mat_VarWrite(file, array, packed ? MAT_COMPRESSION_ZLIB : MAT_COMPRESSION_NONE);
    Mat_VarFree(array);
  }
  Mat_Close(file);
}

TEST(Mat, ReadsVersions5And73) {
  const TempFolder folder;
  for (const bool packed : {false, true}) {
    WriteMat(folder / "a.mat", MAT_FT_MAT5, packed, 1);
    ImportMat(folder / "a.mat", folder / "a.rd.exr", {.pitch_mm = 0.5}, {});
    ExpectValues(ReadDataset(folder / "a.rd.exr"));
  }
  WriteMat(folder / "b.mat", MAT_FT_MAT73, false, 1);
  ImportMat(folder / "b.mat", folder / "b.rd.exr", {.pitch_mm = 0.5}, {});
  ExpectValues(ReadDataset(folder / "b.rd.exr"));
}

TEST(Mat, TheVariableIsAskedFor) {
  const TempFolder folder;
  WriteMat(folder / "a.mat", MAT_FT_MAT5, true, 2);
  const auto message = [&](const ArrayImportOptions& options,
                           std::size_t most = 1 << 20) {
    return ErrorMessage([&] {
      ImportMat(
          folder / "a.mat", folder / "a.rd.exr", {.pitch_mm = 1}, options, {}, most);
    });
  };
  EXPECT_THAT(message({}), HasSubstr("say --variable (it holds: rd0, rd1)"));
  EXPECT_THAT(message({.variable = "x"}), HasSubstr("no variable 'x'"));
  EXPECT_THAT(message({.variable = "rd1"}, 100), HasSubstr("100 are read at most"));
  ImportMat(
      folder / "a.mat", folder / "a.rd.exr", {.pitch_mm = 1}, {.variable = "rd1"});
  ExpectValues(ReadDataset(folder / "a.rd.exr"));
  WriteFile(folder / "a.mat", "not one");
  EXPECT_THAT(message({}), HasSubstr("isn't a MATLAB file"));
}

// A scan beside a structure of a text and of cells, as laboratories keep them.
void WriteMatWithNotes(const std::filesystem::path& path, matio_compression packed) {
  WriteMat(path, MAT_FT_MAT5, packed != MAT_COMPRESSION_NONE, 1);
  std::array<const char*, 2> fields = {"sample", "filters"};
  std::array<std::size_t, 2> one = {1, 1};
  std::array<std::size_t, 2> three = {1, 3};
  matvar_t* notes = Mat_VarCreateStruct("notes", 2, one.data(), fields.data(), 2);
  std::string text = "wax";
  Mat_VarSetStructFieldByName(
      notes,
      "sample",
      0,
      Mat_VarCreate(nullptr, MAT_C_CHAR, MAT_T_UINT8, 2, three.data(), text.data(), 0));
  std::array<matvar_t*, 3> cells = {};
  for (matvar_t*& cell : cells) {
    double value = 0.5;
    cell = Mat_VarCreate(nullptr, MAT_C_DOUBLE, MAT_T_DOUBLE, 2, one.data(), &value, 0);
  }
  Mat_VarSetStructFieldByName(
      notes,
      "filters",
      0,
      Mat_VarCreate(nullptr, MAT_C_CELL, MAT_T_CELL, 2, three.data(), cells.data(), 0));
  mat_t* file = Mat_Open(path.c_str(), MAT_ACC_RDWR);
  ASSERT_NE(file, nullptr);
  Mat_VarWrite(file, notes, packed);
  Mat_VarFree(notes);
  Mat_Close(file);
}

TEST(Mat, WhatLiesBesideTheScanMayBeOfAnyKindButMustFit) {
  const TempFolder folder;
  for (const matio_compression packed : {MAT_COMPRESSION_NONE, MAT_COMPRESSION_ZLIB}) {
    WriteMatWithNotes(folder / "a.mat", packed);
    ImportMat(folder / "a.mat", folder / "a.rd.exr", {.pitch_mm = 0.5}, {});
    ExpectValues(ReadDataset(folder / "a.rd.exr"));
  }
  WriteMatWithNotes(folder / "a.mat", MAT_COMPRESSION_NONE);
  std::string bytes = ReadFile(folder / "a.mat");
  const std::string three("\5\0\0\0\x8\0\0\0\1\0\0\0\3\0\0\0", 16);
  std::size_t changed = 0;
  for (std::size_t at = bytes.find(three); at != std::string::npos;
       at = bytes.find(three, at + 1)) {
    bytes[at + 15] = 0x10;  // 2^28 more letters, or cells
    ++changed;
    WriteFile(folder / "a.mat", bytes);
    EXPECT_THAT(ErrorMessage([&] {
                  ImportMat(
                      folder / "a.mat", folder / "a.rd.exr", {.pitch_mm = 0.5}, {});
                }),
                HasSubstr("the lengths in it don't add up"));
    bytes[at + 15] = 0;
  }
  EXPECT_EQ(changed, 2U);
}

// HDF5 would print its stack of calls beside our line.
TEST(Mat, DamagedFilesOfVersion73AreRefusedInOneLine) {
  const TempFolder folder;
  WriteMat(folder / "good.mat", MAT_FT_MAT73, false, 1);
  const std::string good = ReadFile(folder / "good.mat");
  ::testing::internal::CaptureStderr();
  for (std::size_t byte = 512; byte < good.size(); byte += 41) {
    std::string bad = good;
    bad[byte] = static_cast<char>(bad[byte] ^ 0x5A);
    WriteFile(folder / "a.mat", bad);
    try {
      ImportMat(folder / "a.mat", folder / "a.rd.exr", {.pitch_mm = 1}, {});
    } catch (const Error&) {
    }
  }
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

TEST(Mat, TruncatedAndHostileFilesAreRefused) {
  const TempFolder folder;
  for (const bool packed : {false, true}) {
    WriteMat(folder / "good.mat", MAT_FT_MAT5, packed, 1);
    const std::string good = ReadFile(folder / "good.mat");
    const auto import = [&](const std::string& bytes) {
      WriteFile(folder / "a.mat", bytes);
      ImportMat(folder / "a.mat", folder / "a.rd.exr", {.pitch_mm = 1}, {});
    };
    for (std::size_t size = 0; size < good.size(); size += 83) {
      EXPECT_THROW(import(good.substr(0, size)), Error) << size;
    }
    for (std::size_t byte = 128; byte < std::min<std::size_t>(good.size(), 400);
         byte += 3) {
      std::string bad = good;
      bad[byte] = static_cast<char>(bad[byte] ^ 0x5A);
      try {
        import(bad);
      } catch (const Error&) {
      }
    }
  }
}

#endif

}  // namespace
}  // namespace nacre::reconstruct
