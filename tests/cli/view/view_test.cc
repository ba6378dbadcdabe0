// What the page of `nacre view` asks for, and what it gets.

#include "cli/view/view.h"

#include "cli/view/sample.h"
#include "core/error.h"
#include "core/json.h"
#include "core/png.h"
#include "tests/factor/synthetic.h"
#include "tests/support/temp_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <httplib.h>
#include <span>

namespace nacre::cli::view {
namespace {

using ::testing::HasSubstr;
using testing::TempFolder;
using ::testing::ThrowsMessage;

class ViewTest : public ::testing::Test {
 protected:
  ViewTest() {
    reconstruct::WriteDataset(path_, dataset_);
    factor::WriteMaterial(material_path_, material_);
  }
  Json Ask(const std::map<std::string, web::Handler>& routes,
           const std::string& name,
           const web::Query& query = {}) {
    return ParseJson(routes.at(name)(query).body, name);
  }
  PngImage Picture(const std::map<std::string, web::Handler>& routes,
                   const std::string& name,
                   const web::Query& query = {}) {
    const std::string png = routes.at(name)(query).body;
    return DecodePng(std::span(png.data(), png.size()), name);
  }

  const reconstruct::RdDataset dataset_ =
      testing::MakeChessboard({.points_x = 9, .points_y = 7, .core = 5});
  const factor::Material material_ = testing::MakeMaterial(3);
  const TempFolder folder_;
  const std::filesystem::path path_ = folder_ / "x.rd.exr";
  const std::filesystem::path material_path_ = folder_ / "x.nacre.exr";
};

TEST_F(ViewTest, ASliceIsTheDatasets) {
  const auto routes = OpenView(path_, "", {});
  EXPECT_EQ(Ask(routes, "state.json")["kind"], "dataset");
  const Json slice = Ask(routes, "slice.json", {{"i", "3"}, {"j", "2"}});
  const auto rd = slice["channels"][1]["rd"].get<std::vector<float>>();
  const auto window = dataset_.Window(2 * 9 + 3, 1);
  EXPECT_EQ(rd, std::vector<float>(window.begin(), window.end()));
  EXPECT_NEAR(slice["x_mm"].get<double>(), -1 * dataset_.header.pitch_mm, 1e-9);
  EXPECT_NEAR(slice["y_mm"].get<double>(), 1 * dataset_.header.pitch_mm, 1e-9);
}

TEST_F(ViewTest, AMaterialHasMapsKernelsAndTerms) {
  const auto routes = OpenView(material_path_, "", {});
  const Json state = Ask(routes, "state.json");
  EXPECT_EQ(state["kind"], "material");
  EXPECT_EQ(state["terms"], material_.terms);
  EXPECT_EQ(Picture(routes, "map.png", {{"n", "0"}}).width, material_.MapWidth());
  EXPECT_EQ(Picture(routes, "kernel.png").width, material_.KernelWidth());
  const Json all = Ask(routes, "slice.json", {{"i", "1"}, {"j", "1"}});
  std::vector<float> window(static_cast<std::size_t>(material_.WindowSize()));
  material_.EvaluateWindow(0, 1, 1, window.data());
  EXPECT_EQ(all["channels"][0]["rd"].get<std::vector<float>>(), window);
}

TEST_F(ViewTest, AThingAgainstItselfIsTheSame) {
  const auto routes = OpenView(path_, path_, {});
  const Json slice = Ask(routes, "slice.json");
  EXPECT_EQ(slice["channels"][0]["rd"], slice["channels"][0]["other"]);
}

TEST_F(ViewTest, AnotherGridIsRefused) {
  EXPECT_THAT([&] { OpenView(path_, material_path_, {}); },
              ThrowsMessage<Error>(HasSubstr("9 x 7")));
}

TEST_F(ViewTest, AFileOfAnotherKindIsRefused) {
  WritePng(folder_ / "x.png", PngImage{1, 1, 1, 8, {7}});
  EXPECT_THAT([&] { OpenView(folder_ / "x.png", "", {}); },
              ThrowsMessage<Error>(HasSubstr("x.png")));
}

// Lit everywhere, a sample whose windows reach nowhere beyond it gives its albedo back;
// lit by two discs apart, the sum of both.
TEST_F(ViewTest, LightIsLinear) {
  const std::unique_ptr<Sample> sample = OpenSample(path_, {});
  const double pitch = dataset_.header.pitch_mm;
  const auto left = LightDisc(*sample, -3 * pitch, 0, 0.5 * pitch);
  const auto all = LightDisc(*sample, 0, 0, 100 * pitch);
  // Brute force, from the definition: all of x_o = the middle, over x_i.
  double expected_all = 0;
  double expected_left = 0;
  for (int v = 0; v < 5; ++v) {
    for (int u = 0; u < 5; ++u) {
      const int i = 4 - (u - 2);
      const int j = 3 - (v - 2);
      const auto value = static_cast<double>(
          dataset_.Window(j * 9 + i, 0)[static_cast<std::size_t>(v * 5 + u)]);
      expected_all += value * pitch * pitch;
      expected_left += i == 1 && j == 3 ? value * pitch * pitch : 0;
    }
  }
  EXPECT_NEAR(
      static_cast<double>(all[0][3 * 9 + 4]), expected_all, 1e-5 * expected_all);
  EXPECT_NEAR(static_cast<double>(left[0][3 * 9 + 4]), expected_left, 1e-6);
  const auto window = dataset_.Window(3 * 9 + 1, 0);
  EXPECT_NEAR(static_cast<double>(left[0][3 * 9 + 1]),
              static_cast<double>(window[12]) * pitch * pitch,
              1e-6);
}

TEST_F(ViewTest, AnswersComeOverHttpAndBadQuestionsAreTold) {
  const web::LocalServer server(0, OpenView(path_, "", {}), "no remedy");
  const std::string& url = server.url();
  httplib::Client client("127.0.0.1", std::stoi(url.substr(url.find(':', 6) + 1)));
  const std::string base = url.substr(url.find('/', 8));
  EXPECT_EQ(client.Get(base + "slice.json?i=8&j=6")->status, 200);
  EXPECT_EQ(client.Get(base + "light.png?x=0.1&y=-0.2&r=1&ev=1")->status, 200);
  for (const char* bad : {"slice.json?i=9",
                          "slice.json?i=-1",
                          "slice.json?i=x",
                          "slice.json?i=1.5",
                          "light.png?r=nan",
                          "light.png?x=1e9"}) {
    const auto answer = client.Get(base + bad);
    EXPECT_EQ(answer->status, 400) << bad;
    EXPECT_THAT(answer->body, HasSubstr("must be from")) << bad;
  }
  for (const char* out :
       {"../state.json", "%2e%2e/etc/passwd", "page.cc", "state.json/x"}) {
    EXPECT_EQ(client.Get(base + out)->status, 404) << out;
  }
  EXPECT_EQ(
      client.Get(base + "state.json", {{"Origin", "http://evil.example"}})->status,
      403);
}

}  // namespace
}  // namespace nacre::cli::view
