// From laser spots to a material, on a rig and a phantom that no stage was tuned on.

#include "core/atomic_file.h"
#include "core/json.h"
#include "tests/cli/command.h"
#include "tests/support/temp_folder.h"

#include <gtest/gtest.h>

#include <filesystem>

namespace nacre {
namespace {

using testing::RunJson;

const std::string kRigs = NACRE_RIGS_FOLDER;

class Line : public ::testing::Test {
 protected:
  // Captured once: the tests below look at different ends of the same line.
  static void SetUpTestSuite() {
    folder_ = new testing::TempFolder;
    RunJson({"simulate", kRigs + "/stripes.toml", "--out", File("truth.rd.exr")});
    RunJson({"capture",
             kRigs + "/simulated-stripes.toml",
             "--out",
             File("session"),
             "--seed",
             "77003"});
    RunJson({"calibrate", File("session"), "--out", File("calibration.json")});
    RunJson({"reconstruct",
             File("session"),
             "--calibration",
             File("calibration.json"),
             "--out",
             File("sample.rd.exr")});
  }
  static void TearDownTestSuite() {
    delete folder_;
    folder_ = nullptr;
  }
  static std::string File(const std::string& name) { return (*folder_) / name; }

 private:
  static testing::TempFolder* folder_;
};

testing::TempFolder* Line::folder_ = nullptr;

TEST_F(Line, ReconstructsTheTruth) {
  const Json error = RunJson({"compare", File("sample.rd.exr"), File("truth.rd.exr")});
  EXPECT_LE(error.at("relative_l2").get<double>(), 0.05);
  EXPECT_LE(error.at("worst_total").get<double>(), 0.02);
  EXPECT_GT(error.at("relative_l2").get<double>(), 0) << "a capture has noise";
}

TEST_F(Line, TenTermsAddLittle) {
  const Json fit = RunJson({"factor",
                            File("sample.rd.exr"),
                            "--method",
                            "log-svd",
                            "--terms",
                            "10",
                            "--out",
                            File("sample.nacre.exr")});
  EXPECT_LE(fit.at("relative_l2").get<double>(), 0.03);
  const Json error =
      RunJson({"compare", File("sample.nacre.exr"), File("sample.rd.exr")});
  EXPECT_NEAR(
      error.at("relative_l2").get<double>(), fit.at("relative_l2").get<double>(), 1e-4)
      << "the file holds what was fitted";
}

TEST_F(Line, EveryMethodWritesAndTells) {
  for (const std::string method :
       {"svd", "sqrt-svd", "nmf", "bilinear", "reciprocal"}) {
    const std::string file = File(method + ".nacre.exr");
    const Json fit = RunJson({"factor",
                              File("truth.rd.exr"),
                              "--method",
                              method,
                              "--terms",
                              "2",
                              "--out",
                              file});
    const Json error = RunJson({"compare", file, File("truth.rd.exr")});
    EXPECT_NEAR(error.at("relative_l2").get<double>(),
                fit.at("relative_l2").get<double>(),
                1e-3)
        << method;
    EXPECT_LE(error.at("relative_l2").get<double>(), 0.3) << method;
    EXPECT_EQ(RunJson({"inspect", file}).at("method"), method);
  }
}

TEST_F(Line, PsfKeepsEveryBit) {
  RunJson({"export", File("truth.rd.exr"), "--to", "psf", "--out", File("a.psf")});
  RunJson({"import",
           File("a.psf"),
           "--from",
           "psf",
           "--pitch-mm",
           "1.5",
           "--out",
           File("back.rd.exr")});
  RunJson({"export", File("back.rd.exr"), "--to", "psf", "--out", File("b.psf")});
  EXPECT_EQ(ReadFile(File("a.psf")), ReadFile(File("b.psf")));
  const Json error = RunJson({"compare", File("truth.rd.exr"), File("back.rd.exr")});
  EXPECT_EQ(error.at("relative_l2").get<double>(), 0);
}

TEST_F(Line, ThreadsDoNotChangeABit) {
  for (const char* threads : {"1", "3"}) {
    RunJson({"reconstruct",
             File("session"),
             "--calibration",
             File("calibration.json"),
             "--threads",
             threads,
             "--out",
             File("again.rd.exr")});
    EXPECT_EQ(ReadFile(File("again.rd.exr")), ReadFile(File("sample.rd.exr")));
  }
}

TEST_F(Line, ReportStandsAlone) {
  RunJson({"report", File("sample.rd.exr"), "--out", File("report.html")});
  const std::string page = ReadFile(File("report.html"));
  EXPECT_NE(page.find("data:image/png;base64,"), std::string::npos);
  EXPECT_EQ(page.find("src=\"http"), std::string::npos);
  EXPECT_EQ(page.find("<script"), std::string::npos);
}

}  // namespace
}  // namespace nacre
