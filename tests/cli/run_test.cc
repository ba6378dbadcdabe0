// A project's stages run when, and only when, what they depend on has changed; and the
// commands that a file's provenance names remake it to the bit.

#include "cli/project.h"
#include "cli/remake.h"
#include "core/atomic_file.h"
#include "tests/cli/command.h"
#include "tests/support/error_message.h"
#include "tests/support/temp_folder.h"

#include <gmock/gmock.h>

#include <filesystem>

namespace nacre {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::RunJson;

constexpr const char* kPhantom = R"(channels = ["R", "G", "B"]
[slab]
thickness_mm = "inf"
eta = 1.5
[[medium]]
name = "marble"
sigma_a_per_mm = [0.02, 0.04, 0.07]
sigma_s_per_mm = [2.19, 2.62, 3.00]
g = 0.0
[pattern]
type = "homogeneous"
[grid]
points = [4, 4]
pitch_mm = 0.5
core = 3
)";

constexpr const char* kScene = R"(<scene version="0.6.0">
  <shape type="sphere"><float name="radius" value="4"/>
    <subsurface type="svd">
      <string name="material" value="a b.nacre.exr"/>
      <string name="mapping" value="triplanar"/>
    </subsurface>
  </shape>
  <emitter type="point">
    <point name="position" x="9" y="9" z="20"/><spectrum name="intensity" value="500"/>
  </emitter>
  <sensor type="perspective">
    <transform name="toWorld">
      <lookat origin="0,0,20" target="0,0,0" up="0,1,0"/>
    </transform>
    <film type="hdrfilm">
      <integer name="width" value="8"/><integer name="height" value="8"/>
    </film>
  </sensor>
</scene>
)";

// Listed the wrong way round: the order is found.
constexpr const char* kProject = R"(
[[stage]]
name = "picture"
run = "render ball.xml --spp 1 --out ball.exr"
[[stage]]
name = "material"
run = "nacre factor sample.rd.exr --method svd --terms 2 --out 'a b.nacre.exr'"
[[stage]]
name = "sample"
run = "simulate marble.toml --solver fast --out sample.rd.exr"
)";

class RunTest : public ::testing::Test {
 protected:
  RunTest() {
    WriteFile(folder_ / "marble.toml", kPhantom);
    WriteFile(folder_ / "ball.xml", kScene);
    WriteFile(folder_ / "p.toml", kProject);
  }

  // The names of the stages that ran, in order.
  std::vector<std::string> Ran(const std::vector<std::string>& options = {}) {
    std::vector<std::string> command{"run", folder_ / "p.toml"};
    command.insert(command.end(), options.begin(), options.end());
    std::vector<std::string> names;
    const Json report = RunJson(command);
    for (const Json& stage : report.at("stages")) {
      if (stage.contains("why")) {
        names.push_back(stage.at("name"));
      }
    }
    return names;
  }

  void Replace(const std::string& file,
               const std::string& from,
               const std::string& to) {
    std::string text = ReadFile(folder_ / file);
    const std::size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos);
    WriteFile(folder_ / file, text.replace(at, from.size(), to));
  }

  std::string Message(const std::string& project) {
    WriteFile(folder_ / "p.toml", project);
    return testing::ErrorMessage([&] { cli::ReadProject(folder_ / "p.toml"); });
  }

  testing::TempFolder folder_;
};

TEST_F(RunTest, OnlyWhatChangedAndWhatFollows) {
  EXPECT_THAT(Ran({"--dry-run"}), ElementsAre("sample", "material", "picture"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "sample.rd.exr"));
  EXPECT_THAT(Ran(), ElementsAre("sample", "material", "picture"));
  EXPECT_THAT(Ran(), ElementsAre());

  Replace("p.toml", "--spp 1", "--spp 2");
  EXPECT_THAT(Ran({"--dry-run"}), ElementsAre("picture"));
  EXPECT_THAT(Ran(), ElementsAre("picture"));

  std::filesystem::remove(folder_ / "a b.nacre.exr");
  EXPECT_THAT(Ran(), ElementsAre("material"))
      << "it comes out the same: nothing follows";

  Replace("marble.toml", "pitch_mm = 0.5", "pitch_mm = 0.6");
  EXPECT_THAT(Ran(), ElementsAre("sample", "material", "picture"));

  WriteFile(folder_ / "ball.exr", "spoiled");
  EXPECT_THAT(Ran(), ElementsAre("picture"));
  EXPECT_THAT(Ran({"--force"}), ElementsAre("sample", "material", "picture"));
}

TEST_F(RunTest, AFailedStageRunsAgain) {
  Replace("marble.toml", "core = 3", "core = 4");
  EXPECT_THAT(testing::ErrorMessage([&] { Ran(); }), HasSubstr("stage 'sample'"));
  Replace("marble.toml", "core = 4", "core = 3");
  EXPECT_THAT(Ran(), ElementsAre("sample", "material", "picture"));
}

TEST_F(RunTest, ProvenanceRemakesTheFileToTheBit) {
  Ran();
  const testing::TempFolder other;
  for (const char* file : {"marble.toml", "ball.xml", "a b.nacre.exr"}) {
    std::filesystem::copy(folder_ / file, other / file);
  }
  for (const std::string name : {"sample.rd.exr", "a b.nacre.exr", "ball.exr"}) {
    const Json provenance =
        RunJson({"inspect", folder_ / name, "--provenance"}).at("commands");
    for (const std::string line : provenance) {
      if (line.starts_with("#")) {
        continue;
      }
      std::vector<std::string> words = cli::SplitWords(line);
      words.erase(words.begin());
      for (std::string& word : words) {  // commands are for the folder of the file
        const bool is_file = word.find(".toml") != std::string::npos ||
                             word.find(".xml") != std::string::npos ||
                             word.find(".exr") != std::string::npos;
        word = is_file ? (other / word).string() : word;
      }
      RunJson(words);
    }
    EXPECT_EQ(ReadFile(other / name), ReadFile(folder_ / name)) << provenance;
  }
}

// What came from elsewhere, and a preset, which is a folder.
TEST(Remake, ImportsAndPresetsToo) {
  const testing::TempFolder folder;
  std::string header =
      "{'descr': '<f4', 'fortran_order': False, 'shape': (1, 2, 1, 1), }";
  header.resize(117, ' ');
  std::string npy = std::string("\x93NUMPY\x01\x00\x76\x00", 10) + header + "\n";
  npy += std::string("\0\0\0\x3e\0\0\x80\x3d", 8);  // 0.125, 0.0625
  WriteFile(folder / "scan.npy", npy);
  RunJson({"import",
           folder / "scan.npy",
           "--from",
           "npy",
           "--pitch-mm",
           "2",
           "--out",
           folder / "a.rd.exr"});
  const Json commands =
      RunJson({"inspect", folder / "a.rd.exr", "--provenance"}).at("commands");
  std::vector<std::string> words = cli::SplitWords(commands.back());
  EXPECT_THAT(words, ::testing::IsSupersetOf({"import", "scan.npy", "--from", "npy"}));
  words.erase(words.begin());
  for (std::string& word : words) {
    if (word == "scan.npy" || word == "a.rd.exr") {
      word = (folder / (word == "scan.npy" ? word : "b.rd.exr")).string();
    }
  }
  RunJson(words);
  EXPECT_EQ(ReadFile(folder / "a.rd.exr"), ReadFile(folder / "b.rd.exr"));

  for (const std::filesystem::path& path : {folder / "a.rd.exr", folder / "."}) {
    RunJson({"report", path, "--out", folder / "page.html"});
    const Json of = RunJson({"inspect", folder / "page.html", "--provenance"});
    const bool is_file = path.filename() == "a.rd.exr";
    EXPECT_EQ(of.at("inputs").size(), is_file ? 1U : 3U) << "the folder, and two in it";
    EXPECT_THAT(
        of.at("commands").back().get<std::string>(),
        ::testing::MatchesRegex(is_file ? "nacre report a.rd.exr --out page.html"
                                        : "nacre report .* --out page.html"));
  }

  const Json page{
      {"command", "report"},
      {"inputs", Json::array({{{"folder", "demo"}}, {{"file", "calibration.json"}}})}};
  EXPECT_EQ(cli::CommandsThatRemake(page, "page.html").back(),
            "nacre report demo --out page.html");

  const Json made{{"command", "factor"},
                  {"options", {{"terms", 2}}},
                  {"inputs", Json::array({{{"dataset", Json()}}})}};
  const Json preset{{"command", "preset make"},
                    {"options", {{"name", "one"}, {"title", "One of them"}}},
                    {"inputs", Json::array({{{"material", made}}})}};
  EXPECT_THAT(
      cli::CommandsThatRemake(preset, "one"),
      ElementsAre("# dataset.rd.exr: nothing is known of how it was made",
                  "nacre factor dataset.rd.exr --terms 2 --out made-1.nacre.exr",
                  "nacre preset make made-1.nacre.exr --name one --title 'One of them' "
                  "--out ."));
}

TEST_F(RunTest, SaysWhatIsWrongWithAProject) {
  EXPECT_THAT(Message(""), HasSubstr("no [[stage]]"));
  EXPECT_THAT(Message("[[stage]]\nrun = \"simulate marble.toml\""),
              HasSubstr("p.toml:2: stage[0].run: it writes nothing that is known"));
  EXPECT_THAT(Message("[[stage]]\nrun = \"simulate 'x --out a\""),
              HasSubstr("the quote ' isn't closed"));
  EXPECT_THAT(Message("[[stage]]\nrun = \"edit b --out a\"\n"
                      "[[stage]]\nrun = \"edit a --out b\""),
              HasSubstr("a circle"));
  EXPECT_THAT(Message("[[stage]]\nrun = \"edit b --out a\"\n"
                      "[[stage]]\nrun = \"edit c --out ./a\""),
              HasSubstr("p.toml:4: stage[1].run: 'a' is written by stage 'a' already"));
  EXPECT_THAT(Message("[[stage]]\nrun = \"edit b --out a\"\nread = [\"c\"]"),
              HasSubstr("read"));
}

TEST(SplitWords, KeepsWhatIsQuoted) {
  EXPECT_THAT(cli::SplitWords("  a 'b c' d\"e f\" '' "),
              ElementsAre("a", "b c", "de f", ""));
  EXPECT_EQ(cli::Quoted("it's"), "'it'\\''s'");
  EXPECT_EQ(cli::Quoted("a=b/c.exr"), "a=b/c.exr");
}

}  // namespace
}  // namespace nacre
