#include "render/subsurface/lit_point_cloud.h"

#include "core/error.h"
#include "render/subsurface/patch_tree.h"
#include "tests/render/subsurface/lit_plane.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <vector>

namespace nacre::render {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

double TotalFlux(const std::vector<Patch>& patches, int c) {
  double sum = 0;
  for (const Patch& p : patches) {
    sum += static_cast<double>(p.flux_w[c]);
  }
  return sum;
}

TEST(GatherPatches, KeepsFluxAndArea) {
  const auto lit = LightSphere(5, 0.2F, [](Vec3 p) {
    return Color{1, 2, 3} * (6 + p.z);
  });
  double flux = 0;
  double area = 0;
  for (const LitPoint& p : lit) {
    flux += static_cast<double>(p.area_mm2 * p.flux_density.y);
    area += static_cast<double>(p.area_mm2);
  }
  const auto patches = GatherPatches(lit, 0.6F);
  double patch_area = 0;
  for (const Patch& p : patches) {
    patch_area += static_cast<double>(p.area_mm2);
  }
  EXPECT_LT(patches.size(), lit.size() / 4);
  EXPECT_NEAR(TotalFlux(patches, 1), flux, 1e-6 * flux);
  EXPECT_NEAR(patch_area, area, 1e-6 * area);
}

TEST(GatherPatches, KeepsTheFacesOfAThinSheetApart) {
  std::vector<LitPoint> lit(2);
  lit[0].point.position_mm = {0, 0, 0.01F};
  lit[0].point.normal = {0, 0, 1};
  lit[1].point.position_mm = {0, 0, -0.01F};
  lit[1].point.normal = {0, 0, -1};
  for (LitPoint& p : lit) {
    p.area_mm2 = 1;
    p.flux_density = {1, 1, 1};
  }
  EXPECT_EQ(GatherPatches(lit, 1).size(), 2u);
}

TEST(GatherPatches, KeepsPartsOfAMaterialApart) {
  std::vector<LitPoint> lit(3);
  for (LitPoint& p : lit) {
    p.point.normal = {0, 0, 1};
    p.area_mm2 = 1;
    p.flux_density = {1, 1, 1};
  }
  lit[2].point.uv.x = 0.7F;
  const auto by_u = [](const SurfacePoint& p) { return p.uv.x < 0.5F ? 0 : 1; };
  EXPECT_EQ(GatherPatches(lit, 1).size(), 1u);
  const auto patches = GatherPatches(lit, 1, by_u);
  ASSERT_EQ(patches.size(), 2u);
  EXPECT_EQ(patches[0].flux_w.x, 2);
  EXPECT_EQ(patches[1].flux_w.x, 1);
}

TEST(GatherPatches, NeverAveragesTextureCoordinatesOverASeam) {
  std::vector<LitPoint> lit(2);
  for (std::size_t i = 0; i < 2; ++i) {
    lit[i].point.position_mm = {0.01F * static_cast<float>(i), 0, 0};
    lit[i].point.normal = {0, 0, 1};
    lit[i].point.uv = {i == 0 ? 0.999F : 0.001F, 0.5F};
    lit[i].area_mm2 = 1;
    lit[i].flux_density = {1, 1, 1};
  }
  const auto patches = GatherPatches(lit, 1);
  ASSERT_EQ(patches.size(), 1u);
  EXPECT_TRUE(patches[0].point.uv.x == 0.999F || patches[0].point.uv.x == 0.001F);
}

TEST(GatherPatches, AxesAreTheSpreadOfASquare) {
  const PlaneShape plane{.side_mm = 0.8F, .spacing_mm = 0.05F};
  const auto patches = GatherPatches(LightPlane(plane,
                                                [](Vec3) {
                                                  return Color{1, 1, 1};
                                                }),
                                     100);
  ASSERT_EQ(patches.size(), 1u);
  EXPECT_NEAR(Length(patches[0].axis_a_mm), 0.8F / std::sqrt(12.0F), 0.01F);
  EXPECT_NEAR(Length(patches[0].axis_b_mm), 0.8F / std::sqrt(12.0F), 0.01F);
  EXPECT_NEAR(Dot(patches[0].axis_a_mm, patches[0].axis_b_mm), 0, 1e-6F);
}

TEST(GatherPatches, DropsDarknessAndRejectsNonsense) {
  LitPoint p;
  p.point.normal = {0, 0, 1};
  p.area_mm2 = 1;
  EXPECT_TRUE(GatherPatches({p}, 1).empty());
  p.flux_density = {1, 1, 1};
  LitPoint far = p;
  far.point.position_mm = {5e6F, 0, 0};
  EXPECT_THAT(
      [&] {
        GatherPatches({p, far}, 1);
      },
      ThrowsMessage<Error>(HasSubstr("is its scale in millimetres?")));
  p.point.position_mm.x = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT([&] { GatherPatches({p}, 1); },
              ThrowsMessage<Error>(HasSubstr("isn't finite")));
}

TEST(PatchTree, VisitsEveryPatchOnce) {
  const PatchTree tree(GatherPatches(LightSphere(5,
                                                 0.2F,
                                                 [](Vec3) {
                                                   return Color{1, 1, 1};
                                                 }),
                                     0.5F));
  for (const float extent : {0.0F, 0.3F, 1.0F}) {
    std::vector<int> seen(tree.patches().size());
    int nodes = 0;
    tree.Visit(
        {5, 0, 0},
        100,
        tree.SmallerThan(extent),
        [&](std::int32_t n, Vec3) {
          ++nodes;
          const PatchTree::Node& node = tree.nodes()[static_cast<std::size_t>(n)];
          for (std::int32_t p = node.begin; p < node.end; ++p) {
            ++seen[static_cast<std::size_t>(p)];
          }
        },
        [&](std::int32_t p, Vec3) { ++seen[static_cast<std::size_t>(p)]; });
    EXPECT_TRUE(std::all_of(seen.begin(), seen.end(), [](int n) { return n == 1; }));
    EXPECT_EQ(nodes > 0, extent > 0);
  }
}

TEST(PatchTree, StopsAtItsReach) {
  const PatchTree tree(GatherPatches(LightSphere(5,
                                                 0.2F,
                                                 [](Vec3) {
                                                   return Color{1, 1, 1};
                                                 }),
                                     0.5F));
  std::size_t visited = 0;
  const auto count = [&](std::int32_t, Vec3) { ++visited; };
  tree.Visit({5, 0, 0}, 1, tree.SmallerThan(0), count, count);
  EXPECT_GT(visited, 5u);
  EXPECT_LT(visited, tree.patches().size() / 10);
}

}  // namespace
}  // namespace nacre::render
