// Pictures by several ranks, which are threads here.

#include "core/error.h"
#include "render/job_queue.h"
#include "tests/render/scene_text.h"
#include "tests/support/thread_ranks.h"

#include <gmock/gmock.h>

#include <atomic>

namespace nacre::render::testing {
namespace {

using nacre::testing::OnThreadRanks;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

// Squares numbers, each of them once; `work` does it at the others.
std::vector<std::string> Squares(
    const Ranks& ranks,
    int count,
    const std::function<std::string(std::string_view)>& work,
    std::vector<std::string>& lost) {
  JobQueue queue(ranks, 1);
  if (!ranks.IsRoot()) {
    queue.Serve([](std::string_view) {}, work);
    return {};
  }
  std::vector<std::string> squares(static_cast<std::size_t>(count));
  const auto store = [&](std::int64_t job, std::string_view result) {
    std::string& square = squares[static_cast<std::size_t>(job)];
    EXPECT_TRUE(square.empty()) << job;
    square = result;
  };
  queue.Run({.count = count,
             .describe = [](std::int64_t job) { return std::to_string(job); },
             .here =
                 [&](std::int64_t job) {
                   std::this_thread::sleep_for(std::chrono::milliseconds(1));
                   store(job, std::to_string(job * job));
                 },
             .take = store,
             .between = [] {}});
  queue.Finish();
  lost = queue.lost();
  return squares;
}

std::string Square(std::string_view job) {
  const std::int64_t value = std::stoll(std::string(job));
  return std::to_string(value * value);
}

std::vector<std::string> SquaresAlone(int count) {
  std::vector<std::string> squares;
  for (int k = 0; k < count; ++k) {
    squares.push_back(std::to_string(k * k));
  }
  return squares;
}

TEST(JobQueueTest, EveryJobIsDoneOnce) {
  for (const int size : {1, 2, 4}) {
    for (const int count : {0, 1, 5, 200}) {
      std::atomic<int> elsewhere = 0;
      OnThreadRanks(size, [&](const Ranks& ranks) {
        std::vector<std::string> lost;
        const auto squares = Squares(
            ranks,
            count,
            [&](std::string_view job) {
              ++elsewhere;
              return Square(job);
            },
            lost);
        if (ranks.IsRoot()) {
          EXPECT_EQ(squares, SquaresAlone(count));
          EXPECT_THAT(lost, IsEmpty());
        }
      });
      EXPECT_EQ(elsewhere > 0, size > 1 && count > 0);
    }
  }
}

TEST(JobQueueTest, OthersDoTheJobsOfARankThatFails) {
  OnThreadRanks(3, [&](const Ranks& ranks) {
    std::vector<std::string> lost;
    const auto squares = Squares(
        ranks,
        200,
        [&](std::string_view job) -> std::string {
          if (ranks.rank() == 2 && std::stoi(std::string(job)) > 3) {
            throw Error("the disk is gone");
          }
          return Square(job);
        },
        lost);
    if (ranks.IsRoot()) {
      EXPECT_EQ(squares, SquaresAlone(200));
      EXPECT_THAT(lost, ElementsAre("rank 2: the disk is gone"));
    }
  });
}

TEST(JobQueueTest, TheRootDoesTheJobsOfARankThatIsNotHeardOfAgain) {
  OnThreadRanks(2, [&](const Ranks& ranks) {
    if (!ranks.IsRoot()) {
      return;  // never answers
    }
    std::vector<std::string> lost;
    EXPECT_EQ(Squares(ranks, 30, Square, lost), SquaresAlone(30));
  });
}

// A translucent ball and a glass one over a floor, under a small light.
Scene Balls() {
  return Parse(SceneText(R"(
    <shape type="sphere"><float name="radius" value="0.5"/>
      <point name="center" x="-0.3" y="0" z="0"/>
      <subsurface type="dipole"><string name="material" value="marble"/>
        <float name="scale" value="10"/></subsurface></shape>
    <shape type="sphere"><float name="radius" value="0.3"/>
      <point name="center" x="0.5" y="0" z="0.5"/><bsdf type="dielectric"/></shape>
    <shape type="rectangle"><transform name="toWorld"><scale value="3"/>
      <translate x="0" y="0" z="-0.6"/></transform><bsdf type="diffuse"/></shape>
    <shape type="rectangle"><transform name="toWorld"><scale value="0.3"/>
      <rotate y="1" angle="180"/><translate x="0.6" z="3"/></transform>
      <emitter type="area"><rgb name="radiance" value="30"/></emitter></shape>)",
                         "0, 0, 6",
                         "0, 0, 0",
                         20));
}

TEST(RanksTest, APictureHasTheSameBits) {
  Scene scene = Balls();
  scene.integrator.photons.count = 2000;
  for (const char* integrator : {"path", "sppm", "reference"}) {
    RenderOptions options{.spp = 24,
                          .integrator = integrator,
                          .thread_count = 1,
                          .points_per_patch = 1,
                          .max_lit_points = 3000};
    const bool plans = std::string(integrator) == "path";
    options.spp = plans ? 24 : 3;
    options.lazy = plans;
    const Rendering alone = Render(scene, options);
    for (const int size : plans ? std::vector{2} : std::vector{2, 3}) {
      OnThreadRanks(size, [&](const Ranks& ranks) {
        RenderOptions shared = options;
        shared.ranks = &ranks;
        const Rendering made = Render(scene, shared);
        if (ranks.IsRoot()) {
          EXPECT_EQ(made.image.values, alone.image.values) << integrator << size;
          EXPECT_EQ(made.summary.samples_per_pixel, alone.summary.samples_per_pixel);
          EXPECT_EQ(made.summary.shadow_rays, alone.summary.shadow_rays);
          EXPECT_GT(ranks.traffic().messages_received, size);
        }
      });
    }
  }
}

}  // namespace
}  // namespace nacre::render::testing
