#include "core/atomic_file.h"
#include "core/error.h"
#include "core/exr.h"
#include "core/hash.h"
#include "core/random.h"
#include "factor/material.h"
#include "tests/factor/synthetic.h"
#include "tests/support/temp_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <limits>

namespace nacre::factor {
namespace {

using nacre::testing::MakeMaterial;
using nacre::testing::TempFolder;
using ::testing::HasSubstr;

void ExpectEqual(const Material& a, const Material& b) {
  EXPECT_EQ(a.points_x, b.points_x);
  EXPECT_EQ(a.points_y, b.points_y);
  EXPECT_EQ(a.core, b.core);
  EXPECT_EQ(a.pitch_mm, b.pitch_mm);
  EXPECT_EQ(a.eta, b.eta);
  EXPECT_EQ(a.channels, b.channels);
  EXPECT_EQ(a.method, b.method);
  EXPECT_EQ(a.transform, b.transform);
  EXPECT_EQ(a.terms, b.terms);
  EXPECT_EQ(a.cluster_count, b.cluster_count);
  EXPECT_EQ(a.a, b.a);
  EXPECT_EQ(a.b, b.b);
  EXPECT_EQ(a.f, b.f);
  EXPECT_EQ(a.h, b.h);
  EXPECT_EQ(a.cluster, b.cluster);
  EXPECT_EQ(a.row_scale, b.row_scale);
  EXPECT_EQ(a.albedo, b.albedo);
  EXPECT_EQ(a.error, b.error);
  EXPECT_EQ(a.error_curve, b.error_curve);
  EXPECT_EQ(a.provenance, b.provenance);
}

std::string ReadComplaint(const std::filesystem::path& path) {
  try {
    ReadMaterial(path);
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::kBadData);
    return e.what();
  }
  return "none";
}

TEST(MaterialFile, RoundTripIsExact) {
  const TempFolder folder;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Material m = MakeMaterial(seed);
    WriteMaterial(folder / "m.nacre.exr", m);
    ExpectEqual(ReadMaterial(folder / "m.nacre.exr"), m);
  }
}

TEST(MaterialFile, ChannelsOfAnyNameKeepTheirOrder) {
  const TempFolder folder;
  Material m = MakeMaterial(1);
  m.channels = {"850nm", "B", "532nm"};
  WriteMaterial(folder / "m.nacre.exr", m);
  ExpectEqual(ReadMaterial(folder / "m.nacre.exr"), m);
}

TEST(MaterialFile, SameMaterialSameBytes) {
  const TempFolder folder;
  WriteMaterial(folder / "a.exr", MakeMaterial(4));
  WriteMaterial(folder / "b.exr", MakeMaterial(4));
  EXPECT_EQ(ReadFile(folder / "a.exr"), ReadFile(folder / "b.exr"));
}

TEST(MaterialFile, ViewersSeeTheAlbedoFirst) {
  const TempFolder folder;
  const Material m = MakeMaterial(3);
  WriteMaterial(folder / "m.nacre.exr", m);
  const std::vector<ExrPart> parts = ReadExr(folder / "m.nacre.exr");
  EXPECT_EQ(parts[0].name, "albedo");
  EXPECT_EQ(parts[0].channels, (std::vector<std::string>{"R", "G", "B"}));
  EXPECT_EQ(parts[0].values, m.albedo);
  // Map 1 stands to the right of map 0.
  const ExrPart& factors = FindPart(parts, "factors", "m");
  EXPECT_EQ(factors.width, 10);
  EXPECT_EQ(factors.values[5], m.FactorMap(0, 1)[0]);
}

TEST(MaterialFile, EveryFlippedBitIsFoundOrHarmless) {
  const TempFolder folder;
  const Material m = MakeMaterial(6);
  WriteMaterial(folder / "m.nacre.exr", m);
  const std::string bytes = ReadFile(folder / "m.nacre.exr");
  RandomStream random(8, 0);
  int found = 0;
  for (int n = 0; n < 400; ++n) {
    std::string damaged = bytes;
    const auto at =
        static_cast<std::size_t>(random.Uniform() * static_cast<double>(bytes.size()));
    damaged[at] = static_cast<char>(damaged[at] ^ (1 << (random() % 8)));
    WriteFile(folder / "damaged.exr", damaged);
    try {
      // A flip in what OpenEXR ignores (say the screen window) changes nothing of ours.
      ExpectEqual(ReadMaterial(folder / "damaged.exr"), m);
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ExitCode::kBadData) << e.what();
      ++found;
    }
  }
  EXPECT_GT(found, 300);
}

TEST(MaterialFile, TruncatedFilesAreRefused) {
  const TempFolder folder;
  WriteMaterial(folder / "m.nacre.exr", MakeMaterial(7));
  const std::string bytes = ReadFile(folder / "m.nacre.exr");
  for (std::size_t size = 0; size < bytes.size(); size += 1 + bytes.size() / 60) {
    WriteFile(folder / "cut.exr", bytes.substr(0, size));
    EXPECT_THAT(ReadComplaint(folder / "cut.exr"), HasSubstr("cut.exr")) << size;
  }
}

TEST(MaterialFile, ChangedValuesAndAttributesAreFound) {
  const TempFolder folder;
  WriteMaterial(folder / "m.nacre.exr", MakeMaterial(9));
  const std::vector<ExrPart> parts = ReadExr(folder / "m.nacre.exr");
  std::vector<ExrPart> changed = parts;
  changed[2].values[3] += 1e-6F;
  WriteExr(folder / "value.exr", changed);
  EXPECT_THAT(ReadComplaint(folder / "value.exr"), HasSubstr("checksum"));
  changed = parts;
  changed[0].attributes["nacre.eta"] = "1.4";
  WriteExr(folder / "attribute.exr", changed);
  EXPECT_THAT(ReadComplaint(folder / "attribute.exr"), HasSubstr("checksum"));
}

TEST(MaterialFile, BadAttributesAndPartsAreNamed) {
  const TempFolder folder;
  WriteMaterial(folder / "m.nacre.exr", MakeMaterial(9));
  const std::vector<ExrPart> parts = ReadExr(folder / "m.nacre.exr");
  const std::vector<std::array<const char*, 3>> cases{
      {"nacre.terms", "two", "nacre.terms is 'two', not a number"},
      {"nacre.terms", "0", "nacre.terms is 0, not a count"},
      {"nacre.terms", "3", "part 'factors' is 10 x 4 pixels"},
      {"nacre.terms", "1000000", "part 'factors'"},
      {"nacre.core", "5", "part 'kernels'"},
      {"nacre.points", "5", "nacre.points is '5', not two counts"},
      {"nacre.points", "5 0", "out of range"},
      {"nacre.transform", "cubic", "none of 'linear', 'sqrt' and 'log'"},
      {"nacre.a", "[\"1\", \"2\"]", "a: 2 values where 3 are expected"},
      {"nacre.b", "[\"1\", \"-2\", \"1\"]", "b: -2"},
      {"nacre.b", "[1, 2, 3]", "a number in quotes"},
      {"nacre.channels", "[\"R\", \"G\", \"X\"]", "no channel 'X'"},
      {"nacre.channels", "[1]", "not a name"},
      {"nacre.clusters", "1", "part 'kernels'"},
      {"nacre.pitch_mm", "nan", "pitch_mm"},
      {"nacre.error_curve", "[[1, 2]]", "nacre.error_curve has an entry"},
      {"nacre.error", "{", "nacre.error"}};
  for (const auto& [attribute, text, complaint] : cases) {
    std::vector<ExrPart> changed = parts;
    changed[0].attributes[attribute] = text;
    WriteExr(folder / "bad.exr", changed);
    EXPECT_THAT(ReadComplaint(folder / "bad.exr"), HasSubstr(complaint)) << attribute;
  }
  std::vector<ExrPart> changed = parts;
  changed[0].attributes.erase("nacre.eta");
  WriteExr(folder / "bad.exr", changed);
  EXPECT_THAT(ReadComplaint(folder / "bad.exr"), HasSubstr("nacre.eta is missing"));
  changed = parts;
  changed.erase(changed.begin() + 3);
  WriteExr(folder / "bad.exr", changed);
  EXPECT_THAT(ReadComplaint(folder / "bad.exr"), HasSubstr("no part 'kernels'"));
  changed = parts;
  changed[2].values[4] = std::numeric_limits<float>::quiet_NaN();
  WriteExr(folder / "bad.exr", changed);
  EXPECT_THAT(ReadComplaint(folder / "bad.exr"), HasSubstr("f: value 4 is nan"));
  changed = parts;
  changed[4].values[0] = 0.5F;
  WriteExr(folder / "bad.exr", changed);
  EXPECT_THAT(ReadComplaint(folder / "bad.exr"), HasSubstr("part 'cluster' holds 0.5"));
}

// What version 1 wrote: a sum of floats, without form and margin.
TEST(MaterialFile, FilesOfTheFirstVersionAreRead) {
  const TempFolder folder;
  const Material m = MakeMaterial(2);
  WriteMaterial(folder / "m.nacre.exr", m);
  std::vector<ExrPart> parts = ReadExr(folder / "m.nacre.exr");
  ExrAttributes& attributes = parts[0].attributes;
  for (const char* key : {"nacre.form", "nacre.margin", "nacre.checksum"}) {
    attributes.erase(key);
  }
  attributes["nacre.version"] = "1";
  std::string text;
  for (const auto& [key, value] : attributes) {
    text += key.starts_with("nacre.") ? key + '=' + value + '\n' : "";
  }
  for (const ExrPart& part : parts) {
    text += part.name + ':' +
            HashHex(part.values.data(), part.values.size() * sizeof(float)) + '\n';
  }
  attributes["nacre.checksum"] = HashHex(text.data(), text.size());
  WriteExr(folder / "old.nacre.exr", parts);
  ExpectEqual(ReadMaterial(folder / "old.nacre.exr"), m);
}

TEST(MaterialFile, OtherFilesAreNamed) {
  const TempFolder folder;
  WriteExr(folder / "picture.exr", {{"", 2, 2, {"R"}, {0, 0, 0, 0}, {}}});
  EXPECT_THAT(ReadComplaint(folder / "picture.exr"), HasSubstr("is not a material"));
  WriteMaterial(folder / "m.nacre.exr", MakeMaterial(9));
  std::vector<ExrPart> parts = ReadExr(folder / "m.nacre.exr");
  parts[0].attributes["nacre.version"] = "6";
  WriteExr(folder / "newer.exr", parts);
  EXPECT_THAT(ReadComplaint(folder / "newer.exr"), HasSubstr("newer nacre"));
}

TEST(MaterialFile, RefusesToWriteNonsense) {
  const TempFolder folder;
  Material m = MakeMaterial(1);
  m.f[0] = std::numeric_limits<float>::infinity();
  EXPECT_THROW(WriteMaterial(folder / "m.nacre.exr", m), Error);
  EXPECT_FALSE(std::filesystem::exists(folder / "m.nacre.exr"));
}

}  // namespace
}  // namespace nacre::factor
