#include "core/error.h"
#include "core/fresnel.h"
#include "core/parallel.h"
#include "render/subsurface/material_windows.h"
#include "render/subsurface/models.h"
#include "tests/render/subsurface/handmade_material.h"
#include "tests/render/subsurface/lit_plane.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace nacre::render {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr DipoleParameters kMedium{{0.0071F, 0.02F, 0.05F}, {3.0F, 2.0F, 1.0F}, 1.5F};

std::array<DipoleProfile, 3> Profiles() {
  const double inside = DiffuseFresnelReflectance(1 / 1.5);
  return {DipoleProfile(0.0071, 3, inside),
          DipoleProfile(0.02, 2, inside),
          DipoleProfile(0.05, 1, inside)};
}

struct Difference {
  std::array<double, 3> relative_l2{};
  double worst() const {
    return *std::max_element(relative_l2.begin(), relative_l2.end());
  }
};

Difference Compare(const Subsurface& tested,
                   const Subsurface& reference,
                   const std::vector<SurfacePoint>& at) {
  std::array<double, 3> error{};
  std::array<double, 3> norm{};
  for (const SurfacePoint& p : at) {
    const Color a = tested.Exitance(p);
    const Color b = reference.Exitance(p);
    for (int c = 0; c < 3; ++c) {
      const auto expected = static_cast<double>(b[c]);
      const double e = static_cast<double>(a[c]) - expected;
      error[static_cast<std::size_t>(c)] += e * e;
      norm[static_cast<std::size_t>(c)] += expected * expected;
    }
  }
  Difference d;
  for (std::size_t c = 0; c < 3; ++c) {
    d.relative_l2[c] = std::sqrt(error[c] / norm[c]);
  }
  return d;
}

Color SmoothLight(Vec3 p) {
  return Color{1, 1, 1} * (1 + 0.8F * std::sin(0.4F * p.x + 0.3F * p.y));
}
Color EdgeLight(Vec3 p) {
  return p.x + 0.3F * p.y < 0.37F ? Color{1, 1, 1} : Color{0, 0, 0};
}

class LikeTheDipole : public ::testing::TestWithParam<MaterialShape> {};

TEST_P(LikeTheDipole, OnAPlane) {
  const auto factored = MakeFactored(DipoleMaterial(Profiles(), GetParam()));
  const auto dipole = MakeDipole(kMedium);
  const float side = static_cast<float>(GetParam().pitch_mm) * 48;
  std::vector<SurfacePoint> at;
  const PlaneShape plane{
      .side_mm = side,
      .spacing_mm = std::min(dipole->PatchSizeMm(), factored->PatchSizeMm()) / 3};
  for (int i = 0; i < 400; ++i) {
    at.push_back(plane.At(0.0139F * static_cast<float>(i - 200),
                          0.005F * static_cast<float>(i % 50)));
  }
  for (const auto& light : {SmoothLight, EdgeLight}) {
    const auto lit = LightPlane(plane, light);
    const auto difference =
        Compare(*factored->Illuminate(lit, 2), *dipole->Illuminate(lit, 2), at);
    EXPECT_LT(difference.worst(), 0.02)
        << difference.relative_l2[0] << " " << difference.relative_l2[1] << " "
        << difference.relative_l2[2];
  }
}

TEST_P(LikeTheDipole, OnASphere) {
  const float radius = static_cast<float>(GetParam().pitch_mm) * 12;
  const auto factored = MakeFactored(DipoleMaterial(Profiles(), GetParam()));
  const auto dipole = MakeDipole(kMedium);
  std::vector<SurfacePoint> at;
  for (int i = 0; i < 400; ++i) {
    const float u = static_cast<float>(i) / 400;
    at.push_back(SpherePoint(radius, 7 * u, 1.9F * u - 0.95F));
  }
  const float spacing = std::min(dipole->PatchSizeMm(), factored->PatchSizeMm()) / 2;
  for (const auto& light : {SmoothLight, EdgeLight}) {
    const auto lit = LightSphere(radius, spacing, light);
    const auto difference =
        Compare(*factored->Illuminate(lit, 2), *dipole->Illuminate(lit, 2), at);
    EXPECT_LT(difference.worst(), 0.02)
        << difference.relative_l2[0] << " " << difference.relative_l2[1] << " "
        << difference.relative_l2[2];
  }
}

INSTANTIATE_TEST_SUITE_P(Pitches,
                         LikeTheDipole,
                         ::testing::Values(MaterialShape{4, 79, 0.25},
                                           MaterialShape{4, 39, 1.0},
                                           MaterialShape{4, 31, 1.25}));

TEST(FactoredGather, UniformLightOnAPlaneGivesTheAlbedo) {
  const MaterialShape shape{4, 15, 1.0};
  const auto material = DipoleMaterial(Profiles(), shape);
  const auto model = MakeFactored(material);
  for (const float angle : {0.0F, 0.6F}) {
    const PlaneShape plane{
        .side_mm = 40, .spacing_mm = model->PatchSizeMm() / 4, .angle_rad = angle};
    const auto lit = model->Illuminate(LightPlane(plane,
                                                  [](Vec3) {
                                                    return Color{3, 3, 3};
                                                  }),
                                       1);
    for (std::size_t c = 0; c < 3; ++c) {
      const double expected =
          3 *
          static_cast<double>(
              material->albedo[c * static_cast<std::size_t>(material->PointCount())]);
      double mean = 0;
      for (int i = 0; i < 400; ++i) {
        const double m = static_cast<double>(lit->Exitance(
            plane.At(0.0173F * static_cast<float>(i),
                     0.0071F * static_cast<float>(i)))[static_cast<int>(c)]);
        EXPECT_NEAR(m, expected, 0.03 * expected) << i << " " << angle;
        mean += m / 400;
      }
      EXPECT_NEAR(mean, expected, 0.005 * expected) << c << " " << angle;
    }
  }
}

/// A material that differs to every side and from point to point.
std::shared_ptr<const factor::Material> Lopsided(const MaterialShape& shape) {
  factor::Material m = OneTermMaterial(shape, 3);
  for (std::size_t n = 0; n < m.h.size(); ++n) {
    const auto u = static_cast<float>(n % static_cast<std::size_t>(m.core));
    const auto v = static_cast<float>(n / static_cast<std::size_t>(m.core) %
                                      static_cast<std::size_t>(m.core));
    m.h[n] = 1e-3F * (1 + u + 3 * v);
  }
  for (std::size_t n = 0; n < m.f.size(); ++n) {
    m.f[n] = 1 + 0.25F * static_cast<float>(n % 7);
  }
  SetAlbedo(m);
  return std::make_shared<const factor::Material>(std::move(m));
}

LitPoint SpotAt(const PlaneShape& plane, double x_mm, double y_mm) {
  LitPoint spot;
  spot.point = plane.At(static_cast<float>(x_mm), static_cast<float>(y_mm));
  spot.area_mm2 = 1e-6F;
  spot.flux_density = {1e6F, 1e6F, 1e6F};
  return spot;
}

/// The mean exitance over a cell of side `pitch` around (x, y).
Color CellMean(const Subsurface& lit, const PlaneShape& plane, Vec2 cell, float pitch) {
  constexpr int kSteps = 24;
  Color sum;
  for (int j = 0; j < kSteps; ++j) {
    for (int i = 0; i < kSteps; ++i) {
      const auto along = [&](int k) {
        return ((static_cast<float>(k) + 0.5F) / kSteps - 0.5F) * pitch;
      };
      sum += lit.Exitance(plane.At(cell.x + along(i), cell.y + along(j)));
    }
  }
  return sum / static_cast<float>(kSteps * kSteps);
}

TEST(FactoredGather, OneSpotOnAGridPointGivesItsCells) {
  const MaterialShape shape{6, 9, 0.5};
  const auto material = Lopsided(shape);
  const auto model = MakeFactored(material);
  const PlaneShape plane{.sample_mm = 3};
  for (const std::array<int, 2> ij : {std::array<int, 2>{0, 0}, {4, 1}, {5, 5}}) {
    const double x = (ij[0] - 2.5) * 0.5;
    const double y = (2.5 - ij[1]) * 0.5;
    const auto lit = model->Illuminate({SpotAt(plane, x, y)}, 1);
    for (int n = 0; n < 81; n += 2) {
      const int u = n % 9;
      const int v = n / 9;
      const Color m = CellMean(*lit,
                               plane,
                               {static_cast<float>(x + (u - 4) * 0.5),
                                static_cast<float>(y + (4 - v) * 0.5)},
                               0.5F);
      for (int c = 0; c < 3; ++c) {
        const float expected = material->Evaluate(c, ij[0], ij[1], u, v);
        EXPECT_NEAR(m[c], expected, 5e-3F * expected)
            << ij[0] << "," << ij[1] << " " << u << "," << v;
      }
    }
  }
}

TEST(FactoredGather, CellMeansAreKeptAroundASpot) {
  const MaterialShape shape{4, 15, 1.0};
  const auto material = DipoleMaterial(Profiles(), shape);
  const auto model = MakeFactored(material);
  const PlaneShape plane{.sample_mm = 4};
  const auto lit = model->Illuminate({SpotAt(plane, 0.5, 0.5)}, 1);
  Color all;
  for (int v = -7; v <= 7; ++v) {
    for (int u = -7; u <= 7; ++u) {
      const Color mean = CellMean(
          *lit, plane, {0.5F + static_cast<float>(u), 0.5F + static_cast<float>(v)}, 1);
      all += mean;
      for (int c = 0; c < 3; ++c) {
        const float expected = material->Evaluate(c, 2, 1, 7 + u, 7 - v);
        EXPECT_NEAR(mean[c], expected, 1e-2F * expected) << u << "," << v;
      }
    }
  }
  for (int c = 0; c < 3; ++c) {
    const float albedo =
        material->albedo[static_cast<std::size_t>(c * material->PointCount())];
    EXPECT_NEAR(all[c], albedo, 2e-3F * albedo);
  }
}

// A chessboard whose borders are those of the cells: light of one square stays its own
// however patches lie.
TEST(FactoredGather, BordersOfTheMaterialStaySharp) {
  factor::Material m = *DipoleMaterial(Profiles(), {8, 9, 1.0});
  for (std::size_t n = 0; n < m.row_scale.size(); ++n) {
    m.row_scale[n] = n % 8 < 4 ? 1.0F : 0.4F;
  }
  SetAlbedo(m);
  const auto material = std::make_shared<const factor::Material>(std::move(m));
  const auto model = MakeFactored(material);
  const PlaneShape plane{.side_mm = 8, .spacing_mm = 0.1F, .sample_mm = 8};
  for (const int i : {3, 4}) {  // beside the border, light on one column of cells
    const auto light = [&](Vec3 p) {
      return static_cast<int>(std::floor(p.x)) + 4 == i ? Color{1, 1, 1} : Color{};
    };
    const auto lit = model->Illuminate(LightPlane(plane, light), 1);
    Color sum;
    for (int u = -4; u <= 4; ++u) {
      sum += CellMean(*lit, plane, {static_cast<float>(i + u) - 3.5F, 0}, 1);
    }
    for (int c = 0; c < 3; ++c) {
      const float albedo =
          material->albedo[static_cast<std::size_t>(c * material->PointCount() + i)];
      EXPECT_NEAR(sum[c], albedo, 0.02F * albedo) << i;
    }
  }
}

TEST(FactoredGather, TextureCoordinatesRepeatAndClampAtTheBorder) {
  const MaterialShape shape{6, 5, 0.5};
  const auto model = MakeFactored(Lopsided(shape));
  const auto gather = [&](Vec2 uv) {
    PlaneShape plane;
    LitPoint spot = SpotAt(plane, 0, 0);
    spot.point.uv = uv;
    return model->Illuminate({spot}, 1)->Exitance(plane.At(0.13F, 0.23F));
  };
  EXPECT_NEAR(gather({0.3F, 0.6F}).x / gather({5.3F, -3.4F}).x, 1, 1e-4);
  const MaterialWindows windows(MakeMaterialSource(Lopsided(shape)), 1);
  const auto near_border = windows.EntryAt({0.001F, 0.4F});
  EXPECT_EQ(near_border.window, windows.EntryAt({0.08F, 0.4F}).window);
  EXPECT_NE(near_border.window, windows.EntryAt({0.999F, 0.4F}).window);
  EXPECT_NEAR(near_border.beside.x, -0.494F, 1e-4F);
  EXPECT_EQ(near_border.scale.v[0], windows.EntryAt({0.08F, 0.4F}).scale.v[0]);
}

TEST(FactoredGather, MirroredFramesMirrorTheWindow) {
  const auto model = MakeFactored(Lopsided({6, 9, 0.5}));
  const PlaneShape plane;
  LitPoint spot = SpotAt(plane, 0, 0);
  const auto straight = model->Illuminate({spot}, 1);
  spot.point.tangent_v = -spot.point.tangent_v;
  const auto mirrored = model->Illuminate({spot}, 1);
  const Color a = straight->Exitance(plane.At(1.1F, 1.6F));
  const Color b = mirrored->Exitance(plane.At(1.1F, -1.6F));
  EXPECT_NEAR(a.x, b.x, 1e-6F * a.x);
  EXPECT_GT(std::abs(a.x - mirrored->Exitance(plane.At(1.1F, 1.6F)).x), 0.1F * a.x);
}

TEST(FactoredGather, DistanceIsMeasuredInSpace) {
  const auto model = MakeFactored(DipoleMaterial(Profiles(), {4, 15, 1.0}));
  const PlaneShape plane;
  const auto lit = model->Illuminate({SpotAt(plane, 0, 0)}, 1);
  SurfacePoint below = plane.At(0, 0);
  below.position_mm.z = -4;
  SurfacePoint slanted = plane.At(2.4F, 0);
  slanted.position_mm.z = -3.2F;
  const Color beside = lit->Exitance(plane.At(4, 0));
  EXPECT_NEAR(lit->Exitance(below).x, beside.x, 1e-3F * beside.x);
  EXPECT_NEAR(lit->Exitance(slanted).x, beside.x, 1e-3F * beside.x);
}

TEST(FactoredGather, MemoryNeverChangesAValue) {
  const auto material = Lopsided({6, 9, 0.5});
  const PlaneShape plane{.side_mm = 6, .spacing_mm = 0.1F, .sample_mm = 3};
  const auto lit = LightPlane(plane, SmoothLight);
  const auto kept = MakeFactored(material)->Illuminate(lit, 1);
  const auto some =
      MakeFactored(material, {.window_cache_mb = 0.05})->Illuminate(lit, 1);
  const auto none = MakeFactored(material, {.window_cache_mb = 0})->Illuminate(lit, 1);
  for (int i = 0; i < 20; ++i) {
    const SurfacePoint at = plane.At(0.13F * static_cast<float>(i), 0.3F);
    EXPECT_TRUE(kept->Exitance(at) == none->Exitance(at));
    EXPECT_TRUE(kept->Exitance(at) == some->Exitance(at));
  }
}

TEST(FactoredGather, ClustersAgreeWithEveryPatchOnItsOwn) {
  // Two materials in squares of two points, one three times as bright as the other.
  factor::Material m = *DipoleMaterial(Profiles(), {16, 25, 0.5});
  for (std::size_t n = 0; n < m.row_scale.size(); ++n) {
    m.row_scale[n] = ((n % 16) / 2 + (n / 16) / 2) % 2 == 0 ? 1.0F : 0.33F;
  }
  SetAlbedo(m);
  const auto material = std::make_shared<const factor::Material>(std::move(m));
  const auto clustered = MakeFactored(material);
  const auto every = MakeFactored(material, {.max_relative_extent = 0});
  const PlaneShape plane{.side_mm = 24, .spacing_mm = 0.1F, .sample_mm = 8};
  const auto lit = LightPlane(plane, EdgeLight);
  const auto a = clustered->Illuminate(lit, 1);
  const auto b = every->Illuminate(lit, 1);
  std::vector<SurfacePoint> at;
  for (int i = 0; i < 200; ++i) {
    at.push_back(plane.At(0.05F * static_cast<float>(i - 100), 0.7F));
  }
  EXPECT_LT(Compare(*a, *b, at).worst(), 0.015);
}

// The renderer asks for windows and cells and needn't know what they are made of.
TEST(FactoredGather, ABilinearMaterialIsRenderedLikeTheSumItEquals) {
  const auto sum = DipoleMaterial(Profiles(), {4, 15, 1.0});
  factor::Material m = *sum;
  m.form = factor::Form::kBilinear;
  m.margin = 2;
  m.f.assign(static_cast<std::size_t>(m.MapSize()), 1);
  const auto bilinear = std::make_shared<const factor::Material>(std::move(m));
  const PlaneShape plane{.side_mm = 20, .spacing_mm = 0.3F};
  const auto lit = LightPlane(plane, EdgeLight);
  const auto a = MakeFactored(sum)->Illuminate(lit, 1);
  for (const double cache_mb : {0.0, 64.0}) {
    const auto model = MakeFactored(bilinear, {.window_cache_mb = cache_mb});
    const auto b = model->Illuminate(lit, 1);
    for (int i = 0; i < 40; ++i) {
      const SurfacePoint at = plane.At(0.2F * static_cast<float>(i - 20), 0.3F);
      const Color expected = a->Exitance(at);
      const Color found = b->Exitance(at);
      EXPECT_NEAR(found.x, expected.x, 1e-5F * expected.x);
      EXPECT_NEAR(found.z, expected.z, 1e-5F * expected.z);
    }
  }
}

TEST(FactoredGather, SameBitsForAnyThreads) {
  const auto material = Lopsided({6, 9, 0.5});
  const PlaneShape plane{.side_mm = 6, .spacing_mm = 0.1F, .sample_mm = 3};
  const auto lit = LightPlane(plane, SmoothLight);
  std::vector<Color> first;
  for (const int threads : {1, 2, 3}) {
    const auto model = MakeFactored(material);  // nothing evaluated yet
    const auto gather = model->Illuminate(lit, threads);
    std::vector<Color> m(64);
    ParallelFor(64, threads, [&](std::int64_t i) {
      m[static_cast<std::size_t>(i)] =
          gather->Exitance(plane.At(0.04F * static_cast<float>(i), 0));
    });
    if (first.empty()) {
      first = m;
    }
    EXPECT_TRUE(m == first) << threads;
  }
}

}  // namespace
}  // namespace nacre::render
