// nacre preset: made, listed, shown, checked, and found by scenes.

#include "cli/preset/preset.h"

#include "core/atomic_file.h"
#include "core/exr.h"
#include "render/preset_path.h"
#include "tests/cli/command.h"
#include "tests/cli/exchange/burley_dataset.h"
#include "tests/support/error_message.h"
#include "tests/support/temp_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <utility>

namespace nacre::preset {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using testing::ErrorMessage;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::RunJson;

class PresetTest : public ::testing::Test {
 protected:
  void SetUp() override {
    setenv("NACRE_DATA", NACRE_TEST_DATA, 1);
    reconstruct::WriteDataset(folder_ / "stone.rd.exr",
                              testing::BurleyDataset(4, 9, [](int c, int i, int) {
                                return std::pair(0.3 + 0.2 * c + 0.02 * i, 0.4);
                              }));
    RunJson({"factor",
             folder_ / "stone.rd.exr",
             "--method",
             "svd",
             "--terms",
             "2",
             "--out",
             folder_ / "stone.nacre.exr"});
    made_ = RunJson({"preset",
                     "make",
                     folder_ / "stone.nacre.exr",
                     "--name",
                     "stone",
                     "--title",
                     "A \"grey\" stone",
                     "--dataset",
                     folder_ / "stone.rd.exr",
                     "--out",
                     folder_ / "library",
                     "--thumbnail-px",
                     "16",
                     "--thumbnail-spp",
                     "1"});
  }
  std::string Library() { return folder_ / "library"; }
  std::filesystem::path Folder() { return folder_ / "library/stone"; }
  std::vector<std::string> Problems() { return CheckPreset(ReadPreset(Folder())); }
  // Replaces text in preset.toml and returns what reading it says.
  std::string Without(const std::string& from, const std::string& to) {
    const std::string whole = ReadFile(Folder() / "preset.toml");
    std::string text = whole;
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from << " in\n" << text;
    text.replace(at, from.size(), to);
    WriteFile(Folder() / "preset.toml", text);
    const std::string message = ErrorMessage([&] { ReadPreset(Folder()); });
    WriteFile(Folder() / "preset.toml", whole);
    return message;
  }

  testing::TempFolder folder_;
  Json made_;
};

TEST_F(PresetTest, IsMadeWholeAndReadsBack) {
  const Preset preset = ReadPreset(Folder());
  EXPECT_EQ(preset.name, "stone");
  EXPECT_EQ(preset.title, "A \"grey\" stone");
  EXPECT_EQ(preset.method, "svd");
  EXPECT_DOUBLE_EQ(preset.width_mm, 2);
  EXPECT_EQ(preset.dataset_file, "stone.rd.exr");
  EXPECT_EQ(preset.dataset_hash.size(), 32U);
  EXPECT_LT(preset.error.at("relative_l2"), 0.02);
  EXPECT_THAT(Problems(), IsEmpty());
  EXPECT_EQ(made_.at("bytes").get<std::int64_t>(), preset.Bytes());
  const std::vector<ExrPart> albedo = ReadExr(preset.File("albedo"));
  EXPECT_NEAR(albedo[0].values[0], 0.3, 0.01);
  EXPECT_NEAR(ReadExr(preset.File("radius"))[0].values[0], 0.4, 0.02);
}

TEST_F(PresetTest, ListShowAndCheck) {
  const Json list = RunJson({"preset", "list", "--presets", Library()});
  std::vector<std::string> names;
  for (const Json& preset : list.at("presets")) {
    names.push_back(preset.at("name"));
  }
  EXPECT_THAT(names, Contains("stone"));
  const Json shown = RunJson({"preset", "show", "stone", "--presets", Library()});
  EXPECT_EQ(shown.at("folder"), std::filesystem::absolute(Folder()).string());
  const Json checked = RunJson({"preset", "check", Folder()});
  EXPECT_EQ(checked.at("broken"), 0);
  EXPECT_THAT(ErrorMessage([&] {
                RunJson({"preset", "show", "no-such", "--presets", Library()});
              }),
              HasSubstr("stone"));
}

TEST_F(PresetTest, ScenesFindItByName) {
  EXPECT_EQ(render::FindPreset("stone", Library()),
            std::filesystem::path(Library()) / "stone/material.nacre.exr");
}

TEST_F(PresetTest, CheckFindsWhatIsBroken) {
  WriteFile(Folder() / "thumbnail.png", "no picture");
  EXPECT_THAT(Problems(),
              ElementsAre(HasSubstr("thumbnail.png isn't the file"), HasSubstr("PNG")));
  std::ostringstream out;
  EXPECT_EQ(cli::RunCommand({"preset", "check", Folder(), "--quiet"}, out), 3);
  std::filesystem::remove(Folder() / "radius.exr");
  EXPECT_THAT(Problems(), Contains(HasSubstr("radius.exr is missing")));
  std::filesystem::rename(Folder(), Library() + "/other");
  EXPECT_THAT(CheckPreset(ReadPreset(Library() + "/other")),
              Contains(HasSubstr("isn't called 'stone'")));
}

TEST_F(PresetTest, SwappedMaterialIsSeen) {
  std::string text = ReadFile(Folder() / "preset.toml");
  text.replace(text.find("terms = 1"), 9, "terms = 3");
  WriteFile(Folder() / "preset.toml", text);
  EXPECT_THAT(Problems(), ElementsAre("preset.toml says terms = 3, the material 1"));
}

TEST_F(PresetTest, ErrorsNameTheLine) {
  EXPECT_THAT(Without("nacre-preset", "else"), HasSubstr("preset.toml:1"));
  EXPECT_THAT(Without("version = 1", "version = 9"), HasSubstr("version 1 only"));
  EXPECT_THAT(Without("\"stone\"", "\"a/b\""), HasSubstr("can't be called 'a/b'"));
  EXPECT_THAT(Without("\"albedo.exr\"", "\"../albedo.exr\""),
              HasSubstr("in the preset's own folder"));
  const std::filesystem::path albedo = Folder() / "albedo.exr";
  std::filesystem::rename(albedo, folder_ / "elsewhere.exr");
  std::filesystem::create_symlink(folder_ / "elsewhere.exr", albedo);
  EXPECT_THAT(ErrorMessage([&] { ReadPreset(Folder()); }),
              HasSubstr("elsewhere.exr, outside of the preset's folder"));
  std::filesystem::rename(folder_ / "elsewhere.exr", albedo);
  EXPECT_THAT(Without("size_mm = [2, 2]", "size_mm = [2]"),
              HasSubstr("width and height"));
  EXPECT_THAT(Without("size_mm = [2, 2]", "size_mm = [2, nan]"), HasSubstr("size_mm"));
  EXPECT_THAT(Without("terms = 1", "terms = 1\ncolour = 1"), HasSubstr("colour"));
  EXPECT_THAT(Without("[files]", "[files"), HasSubstr("preset.toml:"));
}

// What can't be read is said, and the others are listed.
TEST_F(PresetTest, OneBrokenPresetDoesntHideTheOthers) {
  WriteFile(folder_ / "library/preset.toml", "");
  std::filesystem::create_directory(Library() + "/broken");
  WriteFile(Library() + "/broken/preset.toml", "format = 1");
  std::vector<std::string> problems;
  const auto presets = FindPresets({Library(), "/no/such/folder"}, problems);
  ASSERT_EQ(presets.size(), 1U);
  EXPECT_THAT(problems, ElementsAre(HasSubstr("broken/preset.toml:1")));
}

}  // namespace
}  // namespace nacre::preset
