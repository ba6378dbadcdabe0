// A video projector on SDL's display for tests, which keeps each picture that it was
// shown as a file.

#include "acquire/projector_illuminator.h"
#include "acquire/rig.h"
#include "core/atomic_file.h"
#include "tests/support/error_message.h"
#include "tests/support/temp_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <SDL.h>
#include <array>
#include <chrono>
#include <cmath>
#include <optional>
#include <thread>

namespace nacre::testing {
namespace {

using namespace std::chrono_literals;
using acquire::ScanAngle;
using ::testing::HasSubstr;

constexpr int kWidth = 1024;  // of that display
constexpr int kHeight = 768;

// Of an angle of 0.4 rad at the ends of the picture.
acquire::ProjectorOptions Options() {
  return {.display = 0,
          .max_angle_rad = 0.4,
          .field_x_rad = {-0.2, 0.1},
          .field_y_rad = {-0.1, 0.15},
          .spot_px = 7,
          .power = {0.2, 0.6, 1.0},
          .settle_ms = 30};
}

template <class Action>
std::string DeviceMessage(const Action& action) {
  return ErrorMessage(action, ExitCode::kDevice);
}

class ProjectorTest : public ::testing::Test {
 protected:
  ProjectorTest() : before_(std::filesystem::current_path()) {
    setenv("SDL_VIDEODRIVER", "dummy", 1);
    setenv("SDL_VIDEO_DUMMY_SAVE_FRAMES", "1", 1);
    std::filesystem::current_path(folder_.path());  // where they are kept
  }
  ~ProjectorTest() override { std::filesystem::current_path(before_); }

  // What the display shows, 0xRRGGBB.
  std::vector<std::uint32_t> Shown() const {
    std::filesystem::path last;
    for (const auto& entry : std::filesystem::directory_iterator(folder_.path())) {
      last = std::max(last, entry.path());
    }
    SDL_Surface* raw = SDL_LoadBMP(last.c_str());
    EXPECT_NE(raw, nullptr) << SDL_GetError();
    SDL_Surface* surface = SDL_ConvertSurfaceFormat(raw, SDL_PIXELFORMAT_RGB888, 0);
    EXPECT_EQ(surface->w, kWidth);
    EXPECT_EQ(surface->h, kHeight);
    std::vector<std::uint32_t> pixels;
    for (int y = 0; y < surface->h; ++y) {
      const auto* row = reinterpret_cast<const std::uint32_t*>(
          static_cast<const char*>(surface->pixels) + y * surface->pitch);
      for (int x = 0; x < surface->w; ++x) {
        pixels.push_back(row[x] & 0xFFFFFF);
      }
    }
    SDL_FreeSurface(raw);
    SDL_FreeSurface(surface);
    return pixels;
  }

  static std::size_t Lit(const std::vector<std::uint32_t>& pixels) {
    return pixels.size() -
           static_cast<std::size_t>(std::count(pixels.begin(), pixels.end(), 0U));
  }

  const std::vector<std::string> channels_{"R", "G", "B"};

 private:
  TempFolder folder_;
  std::filesystem::path before_;
};

TEST_F(ProjectorTest, LightsDiscsWhereItShouldAndNothingElse) {
  acquire::ProjectorIlluminator projector(Options(), channels_);
  EXPECT_EQ(projector.Info().channels, channels_);
  EXPECT_EQ(Lit(Shown()), 0U);
  // 512 pixels are 0.4 rad: 1280 a radian, from the middle at (511.5, 383.5).
  const std::array spots{ScanAngle{0.0504, 0.1003}, ScanAngle{-0.15, -0.05}};
  const std::array<std::array<int, 2>, 2> middles{{{576, 255}, {320, 448}}};
  const std::array<std::uint32_t, 3> colours{51U << 16, 153U << 8, 255U};
  for (int channel = 0; channel < 3; ++channel) {
    projector.Light(spots, channel);
    const std::vector<std::uint32_t> pixels = Shown();
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        bool lit = false;
        for (const auto& middle : middles) {
          lit = lit || std::hypot(x - middle[0], y - middle[1]) <= 3.5;
        }
        ASSERT_EQ(pixels[static_cast<std::size_t>(y * kWidth + x)],
                  lit ? colours[static_cast<std::size_t>(channel)] : 0U)
            << x << ", " << y;
      }
    }
    EXPECT_EQ(Lit(pixels), 2 * 37U);
  }
  EXPECT_EQ(projector.Interruptions(), 0);
}

TEST_F(ProjectorTest, IsBlackAfterBlankErrorAndEnd) {
  const std::array spot{ScanAngle{0, 0}};
  std::optional<acquire::ProjectorIlluminator> projector;
  projector.emplace(Options(), channels_);
  projector->Light(spot, 0);
  EXPECT_EQ(Lit(Shown()), 37U);
  projector->Blank();
  projector->AwaitSteady();
  EXPECT_EQ(Lit(Shown()), 0U);

  const double outermost = 0.1 - 3.5 / 1280;  // whose disc just fits into the field
  const std::array<std::array<ScanAngle, 1>, 5> outside{{{ScanAngle{0.1, 0}},
                                                         {ScanAngle{0, -0.0985}},
                                                         {ScanAngle{0, 0.3}},
                                                         {ScanAngle{1e9, 0}},
                                                         {ScanAngle{NAN, 0}}}};
  for (const auto& spots : outside) {
    projector->Light(std::array{ScanAngle{outermost - 0.5 / 1280, 0}}, 0);
    EXPECT_THAT(DeviceMessage([&] { projector->Light(spots, 0); }),
                HasSubstr("wholly inside"));
    projector->AwaitSteady();
    EXPECT_EQ(Lit(Shown()), 0U);
  }
  EXPECT_THAT(DeviceMessage([&] { projector->Light(spot, 3); }),
              HasSubstr("channel 3; it has 3"));
  projector->Light(spot, 0);
  projector.reset();
  EXPECT_EQ(Lit(Shown()), 0U);
}

TEST_F(ProjectorTest, ReturnsOnceTheLightHasSettled) {
  acquire::ProjectorIlluminator projector(Options(), channels_);
  const auto start = std::chrono::steady_clock::now();
  projector.Light(std::array{ScanAngle{0, 0}}, 1);
  EXPECT_GE(std::chrono::steady_clock::now() - start, 30ms);
  const auto blanked = std::chrono::steady_clock::now();
  projector.Blank();
  projector.AwaitSteady();
  EXPECT_GE(std::chrono::steady_clock::now() - blanked, 30ms);
}

TEST_F(ProjectorTest, AWindowThatSomebodyClosesIsBlackAndAnError) {
  acquire::ProjectorIlluminator projector(Options(), channels_);
  projector.Light(std::array{ScanAngle{0, 0}}, 1);
  SDL_Event event{};
  event.type = SDL_QUIT;
  ASSERT_EQ(SDL_PushEvent(&event), 1);
  for (int k = 0; k < 5000 && projector.Interruptions() == 0; ++k) {
    std::this_thread::sleep_for(1ms);
  }
  EXPECT_EQ(projector.Interruptions(), 1);
  EXPECT_EQ(Lit(Shown()), 0U);
  EXPECT_THAT(DeviceMessage([&] { projector.AwaitSteady(); }), HasSubstr("closed"));
  EXPECT_THAT(DeviceMessage([&] {
                projector.Light(std::array{ScanAngle{0, 0}}, 1);
              }),
              HasSubstr("closed"));
}

TEST_F(ProjectorTest, SaysWhichDisplaysThereAreAndThatTheFieldIsTooLarge) {
  acquire::ProjectorOptions options = Options();
  options.display = 3;
  EXPECT_THAT(DeviceMessage([&] { acquire::ProjectorIlluminator(options, channels_); }),
              ::testing::AllOf(HasSubstr("no display 3"), HasSubstr("1024 x 768")));
  options = Options();
  options.field_y_rad[1] = 0.35;  // the picture reaches 0.3
  EXPECT_THAT(DeviceMessage([&] { acquire::ProjectorIlluminator(options, channels_); }),
              HasSubstr("reaches 0.4000 by 0.3000 rad"));
}

std::string Template() {
  return ReadFile(NACRE_RIGS_FOLDER "/gige-projector.toml", 1 << 20);
}

std::string Message(const std::string& from, const std::string& to) {
  std::string text = Template();
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  text.replace(at, from.size(), to);
  return ErrorMessage([&] { acquire::ParseRig(text, "rig.toml"); });
}

TEST(ProjectorDescription, TheTemplateIsRightAndEachErrorNamesItsLine) {
  const acquire::RigDescription rig = acquire::ParseRig(Template(), "rig.toml");
  EXPECT_FALSE(rig.illuminator);
  ASSERT_TRUE(rig.projector);
  EXPECT_EQ(rig.projector->spot_px, 5);
  EXPECT_THAT(rig.projector->power, ::testing::ElementsAre(1, 1, 1));
  EXPECT_THAT(Message("spot_px = 5", "spot_px = 4"),
              ::testing::AllOf(HasSubstr("rig.toml:"), HasSubstr("is even")));
  EXPECT_THAT(Message("kind = \"projector\"", "kind = \"torch\""),
              HasSubstr("helios, projector"));
  EXPECT_THAT(Message("refresh_hz = 60", "refresh_hz = 50.5"), HasSubstr("whole ones"));
  EXPECT_THAT(Message("display = 1", "display = -1"), HasSubstr("display"));
  EXPECT_THAT(Message("settle_ms = 100", "settle_ms = 1e6"), HasSubstr("settle_ms"));
  EXPECT_THAT(Message("field_x_deg = [-8, 8]", "field_x_deg = [-1, 1]"),
              HasSubstr("the grid asks for"));
  EXPECT_THAT(Message("field_x_deg = [-8, 8]", "field_x_deg = [-30, 8]"),
              HasSubstr("goes beyond"));
  EXPECT_THAT(Message("spot_px = 5", "spots = 5"), HasSubstr("spots"));
  EXPECT_THAT(Message("[scanner]", "[safety]\nmax_power = 1\n[scanner]"),
              HasSubstr("is for lasers"));
}

}  // namespace
}  // namespace nacre::testing
