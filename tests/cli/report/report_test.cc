#include "cli/report/report.h"

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/exr.h"
#include "core/json.h"
#include "core/png.h"
#include "factor/material.h"
#include "tests/factor/synthetic.h"
#include "tests/support/temp_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

namespace nacre::cli::report {
namespace {

using nacre::testing::TempFolder;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

std::size_t Count(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (auto at = text.find(part); at != std::string::npos;
       at = text.find(part, at + part.size())) {
    ++count;
  }
  return count;
}

// A page that needs nothing but itself, whose tags close.
void ExpectSelfContained(const std::string& page) {
  EXPECT_THAT(page, AllOf(HasSubstr("<!DOCTYPE html>"), HasSubstr("</html>")));
  EXPECT_THAT(page, Not(HasSubstr("http://")));
  EXPECT_THAT(page, Not(HasSubstr("https://")));
  EXPECT_THAT(page, Not(HasSubstr("<script")));
  EXPECT_THAT(page.substr(page.find("<body>")), Not(HasSubstr("nan")));
  EXPECT_EQ(Count(page, "src="), Count(page, "src=\"data:image/png;base64,"));
  for (const char* tag : {"figure", "div", "table", "svg", "section", "span"}) {
    EXPECT_EQ(Count(page, std::string("<") + tag + ">") +
                  Count(page, std::string("<") + tag + " "),
              Count(page, std::string("</") + tag + ">"))
        << tag;
  }
}

void WriteSample(const std::filesystem::path& path) {
  reconstruct::WriteDataset(
      path,
      nacre::testing::MakeChessboard(
          {.points_x = 12, .points_y = 10, .core = 7, .noise = 1e-3}));
}

void WritePicture(const std::filesystem::path& path) {
  WritePng(path, {2, 1, 3, 8, {255, 0, 0, 0, 255, 0}});
}

TEST(Report, OnADataset) {
  const TempFolder folder;
  WriteSample(folder / "x.rd.exr");
  const std::string page = BuildReport(folder / "x.rd.exr");
  ExpectSelfContained(page);
  EXPECT_THAT(page, HasSubstr("12 × 10"));
  EXPECT_THAT(page, HasSubstr("No point returns more light than entered"));
  EXPECT_EQ(page, BuildReport(folder / "x.rd.exr"));
}

TEST(Report, SaysWhenEnergyIsGained) {
  const TempFolder folder;
  reconstruct::WriteDataset(folder / "x.rd.exr",
                            nacre::testing::MakeConstant(3, 3, 5, 1));  // albedo 1.56
  EXPECT_THAT(BuildReport(folder / "x.rd.exr"),
              HasSubstr("returns more light than entered: the largest albedo is 1.56"));
}

TEST(Report, OnAnEmptyDataset) {
  const TempFolder folder;
  reconstruct::WriteDataset(folder / "x.rd.exr",
                            nacre::testing::MakeConstant(1, 1, 1, 0));
  const std::string page = BuildReport(folder / "x.rd.exr");
  ExpectSelfContained(page);
  EXPECT_THAT(page, HasSubstr("nothing to show"));
}

TEST(Report, OnAMaterial) {
  const TempFolder folder;
  factor::WriteMaterial(folder / "m.nacre.exr", nacre::testing::MakeMaterial(3));
  const std::string page = BuildReport(folder / "m.nacre.exr");
  ExpectSelfContained(page);
  EXPECT_THAT(page, HasSubstr("log-svd"));
  // Two terms of three channels: six kernels and six maps, two scales, one albedo.
  EXPECT_EQ(Count(page, "<img"), 6u + 6u + 2u + 1u);
}

TEST(Report, OnPictures) {
  const TempFolder folder;
  WritePicture(folder / "p.png");
  WriteExr(folder / "p.exr", {{"", 2, 2, {"Y"}, {0, 1, 2, 3}, {}}});
  for (const char* name : {"p.png", "p.exr"}) {
    const std::string page = BuildReport(folder / name);
    ExpectSelfContained(page);
    EXPECT_THAT(page, HasSubstr(name));
  }
}

TEST(Report, APictureTellsItsNoise) {
  const TempFolder folder;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  // Luminance 2 in four pixels, variance 0.04 in each: 0.1 of it.
  WriteExr(folder / "p.exr",
           {{"image", 2, 2, {"Y"}, {2, 2, 2, 2}, {}},
            {"samples", 2, 2, {"Y"}, {8, 8, 16, nan}, {}},
            {"variance", 2, 2, {"Y"}, {0.04F, 0.04F, 0.04F, 0.04F}, {}}});
  const std::string page = BuildReport(folder / "p.exr");
  ExpectSelfContained(page);
  EXPECT_THAT(page, HasSubstr("error 10.0"));
  EXPECT_THAT(page, HasSubstr("Samples a pixel, up to 16.0"));
  EXPECT_THAT(page, HasSubstr("samples Y"));
  EXPECT_EQ(Count(page, "<img"), 3u);
}

#ifdef NACRE_PRESETS_FOLDER
TEST(Report, OnAPreset) {
  const std::string page =
      BuildReport(std::filesystem::path(NACRE_PRESETS_FOLDER) / "skin");
  ExpectSelfContained(page);
  EXPECT_THAT(page, HasSubstr("Whole: every file"));
  EXPECT_THAT(page, HasSubstr("Factor maps"));
  EXPECT_THAT(page, HasSubstr("Length d of Burley"));
}
#endif

TEST(Report, OnAFolderInTheOrderOfItsStages) {
  const TempFolder folder;
  WriteSample(folder / "z-truth.rd.exr");
  WriteSample(folder / "sample.rd.exr");
  factor::WriteMaterial(folder / "sample.nacre.exr", nacre::testing::MakeMaterial(3));
  WritePicture(folder / "end.png");
  WriteExr(folder / "end.exr", {{"", 1, 1, {"Y"}, {0}, {}}});
  const auto stage = [](const char* name, const char* output, const char* error) {
    return Json{{"name", name},
                {"seconds", 1.5},
                {"cpu_seconds", 2.5},
                {"peak_mb", 77.0},
                {"error", error},
                {"output", output}};
  };
  WriteJson(folder / "stages.json",
            {{"stages",
              {stage("simulate", "z-truth.rd.exr", ""),
               stage("reconstruct", "sample.rd.exr", "R_d off by <1 %"),
               stage("factor", "sample.nacre.exr", "adds 2 %"),
               stage("render", "end.exr", "")}}});
  const std::string page = BuildReport(folder.path());
  ExpectSelfContained(page);
  EXPECT_THAT(page, HasSubstr("R<sub>d</sub> off by &lt;1 %"));
  EXPECT_THAT(page, HasSubstr("<b>6.0</b>"));  // seconds, all stages
  // The picture opens the page, its EXR twin is left out, and truth comes before
  // sample.
  EXPECT_LT(page.find("end.png"), page.find("Where the time went"));
  EXPECT_EQ(page.find("end.exr</code>: "), std::string::npos);
  EXPECT_LT(page.find("<code>z-truth.rd.exr</code></header>"),
            page.find("<code>sample.rd.exr</code></header>"));
  EXPECT_EQ(Count(page, "Energy and reciprocity"), 1u);
}

std::string Complaint(const std::filesystem::path& path) {
  try {
    BuildReport(path);
  } catch (const Error& e) {
    return e.what();
  }
  return "none";
}

TEST(Report, WhatItCannotShowIsNamed) {
  const TempFolder folder;
  EXPECT_THAT(Complaint(folder.path()), HasSubstr("holds no dataset"));
  EXPECT_THAT(Complaint(folder / "none.exr"), HasSubstr("none.exr"));
  WriteFile(folder / "notes.txt", "hello");
  EXPECT_THAT(Complaint(folder / "notes.txt"), HasSubstr("there is no report on"));
  WriteSample(folder / "x.rd.exr");
  WriteFile(folder / "stages.json", R"({"stages": [{"name": "factor"}]})");
  EXPECT_THAT(Complaint(folder.path()), HasSubstr("stages.json"));
  const std::string whole = ReadFile(folder / "x.rd.exr");
  WriteFile(folder / "x.rd.exr", whole.substr(0, whole.size() / 2));
  EXPECT_THAT(Complaint(folder / "x.rd.exr"), HasSubstr("x.rd.exr"));
}

}  // namespace
}  // namespace nacre::cli::report
