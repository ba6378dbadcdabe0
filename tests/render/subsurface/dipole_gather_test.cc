#include "core/error.h"
#include "core/fresnel.h"
#include "core/parallel.h"
#include "render/subsurface/dipole_profile.h"
#include "render/subsurface/models.h"
#include "tests/render/subsurface/lit_plane.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace nacre::render {
namespace {

using std::numbers::pi;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr DipoleParameters kMarble{
    {0.0021F, 0.0041F, 0.0071F}, {2.19F, 2.62F, 3.00F}, 1.5F};
constexpr DipoleParameters kDark{{0.05F, 0.1F, 0.3F}, {1.0F, 1.0F, 1.0F}, 1.5F};

DipoleProfile ProfileOf(const DipoleParameters& p, int c) {
  return {static_cast<double>(p.sigma_a_per_mm[c]),
          static_cast<double>(p.sigma_s_prime_per_mm[c]),
          DiffuseFresnelReflectance(1 / static_cast<double>(p.eta))};
}

/// What leaves the centre line of a plane lit for x < 0 only: ∫ R_d over x_i < −x.
double BehindEdge(const DipoleProfile& profile, double x, double half_side) {
  double sum = 0;
  constexpr int kSteps = 4000;
  // In polar coordinates, r log-spaced; the lit angle is 2 acos(x / r) beyond x.
  const double low = 1e-3;
  const double ratio = std::log(half_side / low) / kSteps;
  for (int i = 0; i < kSteps; ++i) {
    const double r = low * std::exp((i + 0.5) * ratio);
    const double cosine = std::clamp(x / r, -1.0, 1.0);
    sum += profile.Rd(r) * 2 * std::acos(cosine) * r * r * ratio;
  }
  return sum;
}

TEST(DipoleGather, UniformLightOnAPlaneGivesTheAlbedo) {
  for (const float angle : {0.0F, 0.5F}) {
    const auto model = MakeDipole(kDark);
    const PlaneShape plane{
        .side_mm = 60, .spacing_mm = model->PatchSizeMm() / 4, .angle_rad = angle};
    const auto lit = model->Illuminate(LightPlane(plane,
                                                  [](Vec3) {
                                                    return Color{2, 2, 2};
                                                  }),
                                       2);
    for (int c = 0; c < 3; ++c) {
      const double expected = 2 * ProfileOf(kDark, c).FluxWithin(30);
      double mean = 0;
      for (int i = 0; i < 200; ++i) {
        const auto at = static_cast<float>(0.0137 * i);
        const double m = static_cast<double>(lit->Exitance(plane.At(at, 0.4F * at))[c]);
        EXPECT_NEAR(m, expected, 0.015 * expected) << "channel " << c << " at " << at;
        mean += m / 200;
      }
      EXPECT_NEAR(mean, expected, 0.005 * expected) << "channel " << c;
    }
  }
}

TEST(DipoleGather, KnifeEdgeMatchesTheIntegral) {
  const auto model = MakeDipole(kMarble);
  const PlaneShape plane{.side_mm = 40, .spacing_mm = model->PatchSizeMm() / 2};
  const auto lit =
      model->Illuminate(LightPlane(plane,
                                   [](Vec3 p) {
                                     return p.x < 0 ? Color{1, 1, 1} : Color{0, 0, 0};
                                   }),
                        2);
  for (int c = 0; c < 3; ++c) {
    const DipoleProfile profile = ProfileOf(kMarble, c);
    double error2 = 0;
    double norm2 = 0;
    for (int i = -60; i <= 60; ++i) {
      const double x = 0.1 * i;
      const double expected = BehindEdge(profile, x, 20);
      const double m = static_cast<double>(
          lit->Exitance(plane.At(static_cast<float>(x), 0.123F))[c]);
      error2 += (m - expected) * (m - expected);
      norm2 += expected * expected;
    }
    EXPECT_LT(std::sqrt(error2 / norm2), 0.01) << "channel " << c;
  }
}

// The part of a sphere within a distance r, measured through space, of one of its
// points has the area π r² [Archimedes]: gathered over it, R_d gives what a plane's
// disc gives.
TEST(DipoleGather, UniformlyLitSphereGivesTheFluxWithinItsDiameter) {
  for (const float radius : {3.0F, 9.0F}) {
    const auto model = MakeDipole(kDark);
    const auto lit = model->Illuminate(LightSphere(radius,
                                                   model->PatchSizeMm() / 4,
                                                   [](Vec3) {
                                                     return Color{1, 1, 1};
                                                   }),
                                       2);
    for (int c = 0; c < 3; ++c) {
      double mean = 0;
      for (int i = 0; i < 100; ++i) {
        const auto u = static_cast<float>(0.6180340 * i);
        mean += static_cast<double>(lit->Exitance(
                    SpherePoint(radius, u, 0.99F - 0.02F * static_cast<float>(i)))[c]) /
                100;
      }
      const double expected =
          ProfileOf(kDark, c).FluxWithin(2 * static_cast<double>(radius));
      EXPECT_NEAR(mean, expected, 0.005 * expected) << radius << " mm, channel " << c;
    }
  }
}

TEST(DipoleGather, EnergyIsKeptByPatchesWiderThanTheMeanFreePath) {
  const auto model = MakeDipole(kDark, {.patch_mean_free_paths = 3});
  const PlaneShape plane{.side_mm = 80, .spacing_mm = model->PatchSizeMm() / 3};
  const auto lit = model->Illuminate(LightPlane(plane,
                                                [](Vec3) {
                                                  return Color{1, 1, 1};
                                                }),
                                     1);
  for (int c = 0; c < 3; ++c) {
    double mean = 0;
    for (int i = 0; i < 32; ++i) {
      for (int j = 0; j < 32; ++j) {
        const float step = model->PatchSizeMm() * 5 / 32;
        mean += static_cast<double>(lit->Exitance(plane.At(
                    static_cast<float>(i) * step, static_cast<float>(j) * step))[c]) /
                1024;
      }
    }
    const double expected = ProfileOf(kDark, c).FluxWithin(40);
    EXPECT_NEAR(mean, expected, 0.005 * expected) << "channel " << c;
  }
}

TEST(DipoleGather, ClustersAgreeWithEveryPatchOnItsOwn) {
  const auto light = [](Vec3 p) {
    return Color{1, 1, 1} * std::max(0.0F, p.x / 8 + 0.3F * p.y / 8);
  };
  const auto clustered = MakeDipole(kMarble);
  const auto every = MakeDipole(kMarble, {.max_relative_extent = 0, .negligible = 0});
  const auto points = LightSphere(8, clustered->PatchSizeMm() / 2, light);
  const auto a = clustered->Illuminate(points, 2);
  const auto b = every->Illuminate(points, 2);
  for (int i = 0; i < 100; ++i) {
    const auto u = static_cast<float>(i) / 100;
    const SurfacePoint at = SpherePoint(8, u, 0.9F - 1.7F * u);
    for (int c = 0; c < 3; ++c) {
      const float expected = b->Exitance(at)[c];
      EXPECT_NEAR(a->Exitance(at)[c], expected, 0.01F * expected + 1e-4F) << i;
    }
  }
}

TEST(DipoleGather, OneSmallPatchIsTheProfile) {
  const auto model = MakeDipole(kMarble);
  LitPoint spot;
  spot.point.position_mm = {1, 2, 3};
  spot.point.normal = {0, 1, 0};
  spot.area_mm2 = 1e-4F;
  spot.flux_density = {3e4F, 2e4F, 1e4F};  // 3, 2, 1 W
  const auto lit = model->Illuminate({spot}, 1);
  for (const float r : {0.0F, 0.05F, 0.3F, 1.0F, 3.0F, 20.0F}) {
    SurfacePoint x_o;
    x_o.position_mm = {1 + 0.6F * r, 2, 3 + 0.8F * r};
    const Color m = lit->Exitance(x_o);
    for (int c = 0; c < 3; ++c) {
      const double expected =
          (3 - c) * ProfileOf(kMarble, c).Rd(static_cast<double>(r));
      EXPECT_NEAR(static_cast<double>(m[c]), expected, 2e-3 * expected) << r;
    }
  }
}

TEST(DipoleGather, IsReciprocalAndRotationInvariant) {
  const auto model = MakeDipole(kMarble);
  const auto gather = [&](Vec3 from, Vec3 to, Vec3 normal) {
    LitPoint spot;
    spot.point.position_mm = from;
    spot.point.normal = normal;
    spot.area_mm2 = 1e-6F;  // a point: its own extent would lie in its own plane
    spot.flux_density = {1e6F, 1e6F, 1e6F};
    SurfacePoint x_o;
    x_o.position_mm = to;
    return model->Illuminate({spot}, 1)->Exitance(x_o);
  };
  const Vec3 a{0.3F, -0.2F, 0.9F};
  const Vec3 b{0.7F, 0.6F, -0.1F};
  const Color forth = gather(a, b, {1, 0, 0});
  const Color back = gather(b, a, {0, 1, 0});
  const Color turned = gather({a.y, -a.x, a.z}, {b.y, -b.x, b.z}, {0, -1, 0});
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(forth[c], back[c], 1e-5F * forth[c]);
    EXPECT_NEAR(forth[c], turned[c], 1e-5F * forth[c]);
  }
}

TEST(DipoleGather, SameBitsForAnyThreadsAndOrder) {
  const auto model = MakeDipole(kMarble);
  const auto light = [](Vec3 p) { return Color{1, 0.5F, 0.2F} * (2 + p.x); };
  auto points = LightSphere(1.5F, 0.1F, light);
  const auto once = model->Illuminate(points, 1);
  std::reverse(points.begin(), points.end());
  for (const int threads : {1, 2, 3}) {
    const auto again = model->Illuminate(points, threads);
    std::vector<Color> m(64);
    ParallelFor(64, threads, [&](std::int64_t i) {
      const auto u = static_cast<float>(i) / 64;
      m[static_cast<std::size_t>(i)] =
          again->Exitance(SpherePoint(1.5F, u, 1.8F * u - 0.9F));
    });
    for (std::size_t i = 0; i < m.size(); ++i) {
      const auto u = static_cast<float>(i) / 64;
      EXPECT_TRUE(m[i] == once->Exitance(SpherePoint(1.5F, u, 1.8F * u - 0.9F)));
    }
  }
}

TEST(DipoleGather, NoLightNoExitance) {
  const auto model = MakeDipole(kMarble);
  EXPECT_TRUE(model->Illuminate({}, 1)->Exitance({}) == (Color{0, 0, 0}));
}

TEST(MakeDipole, RejectsNonsense) {
  EXPECT_THAT(
      [] {
        MakeDipole({{0, 0, 0}, {0, 1, 1}, 1.5F});
      },
      ThrowsMessage<Error>(HasSubstr("one not zero")));
  EXPECT_THAT(
      [] {
        MakeDipole({{1, 1, 1}, {0, 0, 0}, 1.5F});
      },
      ThrowsMessage<Error>(HasSubstr("scatters in no channel")));
  EXPECT_THAT(
      [] {
        MakeDipole({{1, 1, 1}, {1, 1, 1}, 0.8F});
      },
      ThrowsMessage<Error>(HasSubstr("refractive index 0.8")));
  EXPECT_THAT([] { MakeDipole(kMarble, {.max_relative_extent = 2}); },
              ThrowsMessage<Error>(HasSubstr("max_relative_extent")));
}

}  // namespace
}  // namespace nacre::render
