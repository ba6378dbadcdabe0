#include "factor/material_file.h"

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/exr.h"
#include "core/hash.h"
#include "core/random.h"
#include "tests/factor/synthetic.h"
#include "tests/support/temp_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <fmt/format.h>
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

// Checksums as factor/README.md tells, so that what a file says is looked at.
void Seal(std::vector<ExrPart>& parts) {
  std::string sums;
  for (const ExrPart& part : parts) {
    sums += fmt::format("{}\"{}\":\"{:016x}\"",
                        sums.empty() ? "" : ",",
                        part.name,
                        Hash64(part.values.data(), part.values.size() * sizeof(float)));
  }
  ExrAttributes& attributes = parts[0].attributes;
  attributes["nacre.parts"] = "{" + sums + "}";
  attributes.erase("nacre.checksum");
  std::string text;
  for (const auto& [key, value] : attributes) {
    text += key.starts_with("nacre.") ? key + '=' + value + '\n' : "";
  }
  attributes["nacre.checksum"] = HashHex(text.data(), text.size());
}

ExrPart& PartOf(std::vector<ExrPart>& parts, const std::string& name) {
  return const_cast<ExrPart&>(FindPart(parts, name, "a test's file"));
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
  const ExrPart& factors = FindPart(parts, "factors.G", "m");
  EXPECT_EQ(factors.channels, std::vector<std::string>{"G"});
  EXPECT_EQ(factors.width, 10);
  EXPECT_EQ(factors.values[5], m.FactorMap(1, 1)[0]);
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
  PartOf(changed, "factors.R").values[3] += 1e-6F;
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
      {"nacre.terms", "3", "part 'factors.R' is 10 x 4 pixels"},
      {"nacre.terms", "1000000", "part 'factors.R'"},
      {"nacre.core", "5", "part 'kernels.R'"},
      {"nacre.points", "5", "nacre.points is '5', not two counts"},
      {"nacre.points", "5 0", "out of range"},
      {"nacre.transform", "cubic", "none of 'linear', 'sqrt' and 'log'"},
      {"nacre.a", "[\"1\", \"2\"]", "a: 2 values where 3 are expected"},
      {"nacre.b", "[\"1\", \"-2\", \"1\"]", "b: -2"},
      {"nacre.b", "[1, 2, 3]", "a number in quotes"},
      {"nacre.channels", "[\"R\", \"G\", \"X\"]", "no channel 'X'"},
      {"nacre.channels", "[1]", "not a name"},
      {"nacre.clusters", "1", "part 'kernels.R'"},
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
  std::erase_if(changed, [](const ExrPart& part) { return part.name == "kernels.G"; });
  WriteExr(folder / "bad.exr", changed);
  EXPECT_THAT(ReadComplaint(folder / "bad.exr"), HasSubstr("no part 'kernels.G'"));
  changed = parts;
  PartOf(changed, "factors.R").values[4] = std::numeric_limits<float>::quiet_NaN();
  Seal(changed);
  WriteExr(folder / "bad.exr", changed);
  EXPECT_THAT(ReadComplaint(folder / "bad.exr"), HasSubstr("f: value 4 is nan"));
  changed = parts;
  PartOf(changed, "cluster").values[0] = 0.5F;
  Seal(changed);
  WriteExr(folder / "bad.exr", changed);
  EXPECT_THAT(ReadComplaint(folder / "bad.exr"), HasSubstr("part 'cluster' holds 0.5"));
}

// The parts of one kind as one part of all channels, as up to version 5.
ExrPart Together(std::vector<ExrPart>& parts, const std::string& name) {
  ExrPart all = PartOf(parts, name + ".R");
  all.name = name;
  all.attributes.clear();  // has the name, too
  all.channels = {"R", "G", "B"};
  for (const char* channel : {".G", ".B"}) {
    const ExrPart& one = PartOf(parts, name + channel);
    all.values.insert(all.values.end(), one.values.begin(), one.values.end());
  }
  return all;
}

// What version 1 wrote: a sum of floats, without form and margin.
TEST(MaterialFile, FilesOfTheFirstVersionAreRead) {
  const TempFolder folder;
  const Material m = MakeMaterial(2);
  WriteMaterial(folder / "m.nacre.exr", m);
  std::vector<ExrPart> now = ReadExr(folder / "m.nacre.exr");
  std::vector<ExrPart> parts{PartOf(now, "albedo"),
                             PartOf(now, "row_scale"),
                             Together(now, "factors"),
                             Together(now, "kernels"),
                             PartOf(now, "cluster")};
  ExrAttributes& attributes = parts[0].attributes;
  for (const char* key :
       {"nacre.form", "nacre.margin", "nacre.parts", "nacre.checksum"}) {
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
  const MaterialFile file(folder / "old.nacre.exr");
  ExpectEqual(file.Channel(2), ChannelOf(m, 2));
  EXPECT_EQ(file.channels_read(), 3);
  parts[2].values[3] += 1e-6F;
  WriteExr(folder / "old.nacre.exr", parts);
  EXPECT_THAT(ReadComplaint(folder / "old.nacre.exr"), HasSubstr("checksum"));
}

TEST(MaterialFile, OtherFilesAreNamed) {
  const TempFolder folder;
  WriteExr(folder / "picture.exr", {{"", 2, 2, {"R"}, {0, 0, 0, 0}, {}}});
  EXPECT_THAT(ReadComplaint(folder / "picture.exr"), HasSubstr("is not a material"));
  WriteMaterial(folder / "m.nacre.exr", MakeMaterial(9));
  std::vector<ExrPart> parts = ReadExr(folder / "m.nacre.exr");
  parts[0].attributes["nacre.version"] = "7";
  WriteExr(folder / "newer.exr", parts);
  EXPECT_THAT(ReadComplaint(folder / "newer.exr"), HasSubstr("newer nacre"));
}

TEST(MaterialFile, OneChannelIsThatOfTheWhole) {
  const Material m = MakeMaterial(3);
  std::vector<float> whole(static_cast<std::size_t>(m.WindowSize()));
  std::vector<float> alone(whole.size());
  for (int c = 0; c < 3; ++c) {
    const Material one = ChannelOf(m, c);
    Validate(one, "one channel");
    EXPECT_EQ(one.channels, std::vector<std::string>{m.channels[std::size_t(c)]});
    m.EvaluateWindow(c, 1, 2, whole.data());
    one.EvaluateWindow(0, 1, 2, alone.data());
    EXPECT_EQ(whole, alone);
  }
}

TEST(MaterialFile, ChannelsAreReadWhenTheyAreAskedFor) {
  const TempFolder folder;
  const Material m = MakeMaterial(5);
  WriteMaterial(folder / "m.nacre.exr", m);
  const MaterialFile file(folder / "m.nacre.exr");
  EXPECT_EQ(file.header().channels, m.channels);
  EXPECT_TRUE(file.header().f.empty());
  EXPECT_EQ(file.values_read(), 0);
  ExpectEqual(file.Channel(1), ChannelOf(m, 1));
  EXPECT_EQ(&file.Channel(1), &file.Channel(1));
  EXPECT_EQ(file.channels_read(), 1);
  const std::int64_t of_one = file.values_read();
  EXPECT_EQ(of_one,
            (std::ssize(m.f) + std::ssize(m.h)) / 3 + 2 * std::ssize(m.albedo) +
                m.PointCount());
  ExpectEqual(file.Channel(0), ChannelOf(m, 0));
  // What channels share isn't read again.
  EXPECT_EQ(file.values_read() - of_one, (std::ssize(m.f) + std::ssize(m.h)) / 3);
}

// A channel's damage is found when it is read, and only then.
TEST(MaterialFile, DamageIsFoundInTheChannelThatHasIt) {
  const TempFolder folder;
  WriteMaterial(folder / "m.nacre.exr", MakeMaterial(5));
  std::vector<ExrPart> parts = ReadExr(folder / "m.nacre.exr");
  PartOf(parts, "kernels.B").values[0] += 1e-6F;
  WriteExr(folder / "m.nacre.exr", parts);
  const MaterialFile file(folder / "m.nacre.exr");
  EXPECT_NO_THROW(file.Channel(0));
  for (int n = 0; n < 2; ++n) {
    EXPECT_THROW(file.Channel(2), Error);
  }
  EXPECT_NO_THROW(file.Channel(1));
}

TEST(MaterialFile, GreyChannelsAreKeptOnce) {
  const TempFolder folder;
  Material m = MakeMaterial(5);
  const std::vector<std::string> names = m.channels;
  m = ChannelOf(m, 1);
  m.channels = names;
  m.is_grey = true;
  for (auto* values : {&m.row_scale, &m.albedo}) {
    const std::vector<float> once = *values;
    values->insert(values->end(), once.begin(), once.end());
    values->insert(values->end(), once.begin(), once.end());
  }
  m.a.resize(3, m.a[0]);
  m.b.resize(3, m.b[0]);
  WriteMaterial(folder / "m.nacre.exr", m);
  ExpectEqual(ReadMaterial(folder / "m.nacre.exr"), m);
  const MaterialFile file(folder / "m.nacre.exr");
  for (int c = 0; c < 3; ++c) {
    ExpectEqual(file.Channel(c), ChannelOf(m, c));
  }
  EXPECT_EQ(file.values_read(), std::ssize(m.f) + std::ssize(m.h) + 3 * m.PointCount());
  m.albedo.back() += 1;
  EXPECT_THROW(WriteMaterial(folder / "m.nacre.exr", m), Error);
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
