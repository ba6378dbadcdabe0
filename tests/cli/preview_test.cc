// The live page, as a browser sees it and as somebody who shouldn't see it does.

#include "cli/preview/monitor.h"
#include "cli/preview/server.h"
#include "core/json.h"
#include "core/png.h"
#include "tests/acquire/fake_rig.h"
#include "tests/support/temp_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <fmt/format.h>
#include <httplib.h>
#include <span>

namespace nacre::cli::preview {
namespace {

using ::testing::HasSubstr;
using testing::TempFolder;

constexpr int kWidth = 320;
constexpr int kHeight = 200;

acquire::CameraInfo Camera() {
  acquire::CameraInfo camera;
  camera.model = "test camera";
  camera.serial = "7";
  camera.width = kWidth;
  camera.height = kHeight;
  camera.bit_depth = 12;
  return camera;
}

// A ramp from left to right whose right tenth is saturated.
std::shared_ptr<const acquire::Frame> Ramp() {
  acquire::Frame frame;
  frame.width = kWidth;
  frame.height = kHeight;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      frame.counts.push_back(
          static_cast<std::uint16_t>(std::min(4095, x * 4095 / 288)));
    }
  }
  frame.exposure_us = 2500;
  frame.temperature_c = 41.5;
  frame.attempts = 3;
  return std::make_shared<const acquire::Frame>(std::move(frame));
}

class PreviewTest : public ::testing::Test {
 protected:
  PreviewTest() {
    monitor_.OnProgress({.stage = "capture", .done = 40, .total = 85, .note = ""});
    monitor_.OnFrame(39, Ramp());
  }
  std::string Path(const std::string& name = "") const {
    return server_.url().substr(server_.url().find('/', 8)) + name;
  }
  int Port() const {
    const std::size_t colon = server_.url().find(':', 6);
    return std::stoi(server_.url().substr(colon + 1));
  }

  Monitor monitor_{testing::TestRig(), Camera()};
  Server server_{monitor_, 0};
};

TEST_F(PreviewTest, TheStateSaysWhatWasCaptured) {
  const Json state = ParseJson(monitor_.StateJson(), "state");
  EXPECT_EQ(state["sample"], "test sample");
  EXPECT_EQ(state["done"], 40);
  EXPECT_EQ(state["total"], 85);
  EXPECT_EQ(state["faults"]["frames_retaken"], 2);
  const Json& picture = state["picture"];
  EXPECT_EQ(picture["number"], 39);
  EXPECT_EQ(picture["target"], "sample");
  EXPECT_EQ(picture["largest"], 4095);
  EXPECT_EQ(picture["temperature_c"], 41.5);
  EXPECT_NEAR(picture["saturated"].get<double>(), 32.0 / 320, 1e-12);
  std::int64_t pixels = 0;
  for (const Json& bin : picture["histogram"]) {
    pixels += bin.get<std::int64_t>();
  }
  EXPECT_EQ(pixels, kWidth * kHeight);
}

TEST_F(PreviewTest, ThePictureShrinksAndMarksWhatIsSaturated) {
  const std::string png = monitor_.FramePng(160);
  const PngImage image = DecodePng(std::span(png.data(), png.size()), "frame");
  EXPECT_EQ(image.width, 160);
  EXPECT_EQ(image.height, 100);
  const auto pixel = [&](std::size_t x) {
    return std::vector<int>{
        image.values[3 * x], image.values[3 * x + 1], image.values[3 * x + 2]};
  };
  EXPECT_EQ(pixel(150), (std::vector<int>{255, 40, 40}));
  // A quarter of the range is half as bright: (14 + 28) / 2 counts of 4095 / 288 each.
  EXPECT_NEAR(pixel(36)[0], 255 * std::sqrt(72.5 / 288), 1);
  EXPECT_EQ(pixel(36)[0], pixel(36)[2]);
}

TEST_F(PreviewTest, AnEtaNeedsPictures) {
  Monitor fresh(testing::TestRig(), Camera());
  EXPECT_EQ(fresh.FramePng(100), "");
  const Json state = ParseJson(fresh.StateJson(), "state");
  EXPECT_EQ(state["eta_s"], 0);
  EXPECT_TRUE(state["picture"].is_null());
}

TEST_F(PreviewTest, TheLastWordIsAwaitedByWhoLooks) {
  EXPECT_FALSE(monitor_.IsLastWordAwaited()) << "nobody looked";
  monitor_.StateJson();
  monitor_.OnEnd("done");
  EXPECT_TRUE(monitor_.IsLastWordAwaited());
  EXPECT_EQ(ParseJson(monitor_.StateJson(), "state")["end"], "done");
  EXPECT_FALSE(monitor_.IsLastWordAwaited());
}

TEST_F(PreviewTest, OnlyWhoKnowsTheTokenIsAnswered) {
  httplib::Client client("127.0.0.1", Port());
  EXPECT_EQ(client.Get(Path())->status, 200);
  EXPECT_EQ(client.Get(Path("state.json"))->status, 200);
  EXPECT_EQ(client.Get(Path("frame.png"))->get_header_value("Content-Type"),
            "image/png");
  EXPECT_EQ(client.Get("/")->status, 404);
  EXPECT_EQ(client.Get("/state.json")->status, 404);
  std::string wrong = Path("state.json");
  wrong[1] = wrong[1] == '0' ? '1' : '0';
  EXPECT_EQ(client.Get(wrong)->status, 404);
  EXPECT_EQ(client.Post(Path())->status, 404);
  for (const char* path : {"../../../../etc/passwd",
                           "..%2f..%2f..%2fetc%2fpasswd",
                           "%2e%2e/%2e%2e/etc/passwd",
                           "/etc/passwd",
                           "....//etc/passwd",
                           "state.json%00.html"}) {
    EXPECT_EQ(client.Get(Path(path))->status, 404) << path;
  }
  EXPECT_GE(Path().size(), 34U) << "128 bits of it";
  EXPECT_NE(Server(monitor_, 0).url().substr(20), server_.url().substr(20));
}

TEST_F(PreviewTest, AnotherHostsNameIsRefused) {
  httplib::Client client("127.0.0.1", Port());
  EXPECT_EQ(client.Get(Path("state.json"), {{"Host", "evil.example"}})->status, 403);
  EXPECT_EQ(client.Get(Path("state.json"), {{"Origin", "http://evil.example"}})->status,
            403);
}

TEST_F(PreviewTest, ThePageNeedsNothingFromElsewhere) {
  httplib::Client client("127.0.0.1", Port());
  const auto answer = client.Get(Path());
  EXPECT_EQ(answer->body.find("http://"), std::string::npos);
  EXPECT_EQ(answer->body.find("https://"), std::string::npos);
  EXPECT_THAT(answer->get_header_value("Content-Security-Policy"),
              HasSubstr("default-src 'none'"));
}

TEST_F(PreviewTest, ATakenPortIsAnError) {
  EXPECT_THROW(Server(monitor_, Port()), Error);
}

#ifdef NACRE_CHROMIUM

// What a browser makes of the page; its profile stays in `folder`.
std::string Browse(const TempFolder& folder,
                   const std::string& url,
                   const std::string& how) {
  const std::string command = fmt::format(
      "HOME='{0}' '{1}' --headless --no-sandbox --disable-gpu --disable-dev-shm-usage "
      "--no-first-run --user-data-dir='{0}/profile' --window-size=1300,800 "
      "--virtual-time-budget=3000 {2} '{3}' 2>/dev/null",
      folder.path().string(),
      NACRE_CHROMIUM,
      how,
      url);
  FILE* pipe = ::popen(command.c_str(), "r");
  std::string text;
  char buffer[4096];
  while (const std::size_t n = std::fread(buffer, 1, sizeof buffer, pipe)) {
    text.append(buffer, n);
  }
  ::pclose(pipe);
  return text;
}

TEST_F(PreviewTest, ABrowserShowsIt) {
  const TempFolder folder;
  const std::string page = Browse(folder, server_.url(), "--dump-dom");
  for (const char* shown : {"<h1 id=\"sample\">test sample</h1>",
                            "40 of 85",
                            "sample, laser G, spots of group 4 (picture 39)",
                            "2.5 ms",
                            "10.000 %",
                            "4095 of 4095",
                            "41.5 °C",
                            "2 of 1",
                            "src=\"frame.png?n=39\""}) {
    EXPECT_THAT(page, HasSubstr(shown));
  }
  std::size_t bars = 0;
  for (std::size_t at = page.find("fill=\"#"); at != std::string::npos;
       at = page.find("fill=\"#", at + 1)) {
    ++bars;
  }
  EXPECT_EQ(bars, 64U) << "of the histogram";
}

TEST_F(PreviewTest, ABrowserPaintsIt) {
  const TempFolder folder;
  const std::filesystem::path shot = folder / "page.png";
  Browse(folder, server_.url(), "--screenshot='" + shot.string() + "'");
  const PngImage image = ReadPng(shot);
  EXPECT_EQ(image.width, 1300);
  std::int64_t red = 0;
  std::int64_t blue = 0;
  for (std::size_t k = 0; k + 2 < image.values.size();
       k += static_cast<std::size_t>(image.channel_count)) {
    const int r = image.values[k];
    const int g = image.values[k + 1];
    const int b = image.values[k + 2];
    red += r == 255 && g == 40 && b == 40 ? 1 : 0;
    blue += r == 0x6A && g == 0xA7 && b == 0xFF ? 1 : 0;
  }
  EXPECT_GT(red, 10'000) << "the saturated tenth of the picture";
  EXPECT_GT(blue, 1'000) << "the histogram's bars";
}

#endif

}  // namespace
}  // namespace nacre::cli::preview
