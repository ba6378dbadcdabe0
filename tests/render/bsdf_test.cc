// Every BSDF: sampling agrees with its density, weights with values, and nothing is
// lost or made.
#include "core/fresnel.h"
#include "core/random.h"
#include "render/bsdf/albedo_table.h"
#include "render/bsdf/bsdfs.h"
#include "render/bsdf/fresnel.h"
#include "render/warp.h"

#include <gtest/gtest.h>

#include <map>
#include <string>
#include <vector>

namespace nacre::render {
namespace {

TexturePtr Grey(float v) {
  return MakeConstant({v, v, v});
}

PlasticParameters PlasticOf(float diffuse, bool nonlinear) {
  return {Grey(diffuse), Grey(1), 1.5F, nonlinear};
}

// Those that lose nothing; what isn't listed is Fresnel's part in metals and colour.
std::map<std::string, BsdfPtr> WhiteBsdfs() {
  std::map<std::string, BsdfPtr> bsdfs;
  bsdfs["diffuse"] = MakeDiffuse(Grey(1));
  bsdfs["plastic"] = MakePlastic(PlasticOf(1, false));
  bsdfs["plastic nonlinear"] = MakePlastic(PlasticOf(1, true));
  for (const float alpha : {0.05F, 0.3F, 0.8F}) {
    for (const auto kind : {Microfacet::Kind::kGgx, Microfacet::Kind::kBeckmann}) {
      const Microfacet facets{kind, alpha};
      const std::string name =
          (kind == Microfacet::Kind::kGgx ? " ggx " : " beckmann ") +
          std::to_string(alpha);
      bsdfs["roughplastic" + name] = MakeRoughPlastic(PlasticOf(1, true), facets);
      bsdfs["roughconductor" + name] = MakeRoughConductor(
          {.specular_reflectance = Grey(1), .perfect = true}, facets);
    }
  }
  bsdfs["conductor"] =
      MakeConductor({.specular_reflectance = Grey(1), .perfect = true});
  bsdfs["twosided"] = MakeTwoSided(MakeDiffuse(Grey(1)));
  return bsdfs;
}

Vec3 DirectionOf(float cosine) {
  return {std::sqrt(1 - cosine * cosine), 0, cosine};
}

// In a furnace of radiance 1, the mean weight is the reflected radiance: 1. The bound
// is four standard errors, plus 1e-3 for the interpolated tables.
TEST(BsdfTest, WhiteFurnace) {
  for (const auto& [name, bsdf] : WhiteBsdfs()) {
    for (const float cosine : {0.999F, 0.7F, 0.3F, 0.08F}) {
      const Vec3 wo = DirectionOf(cosine);
      RandomStream random(1, 2);
      constexpr int kCount = 60000;
      double sum = 0;
      double sum2 = 0;
      for (int i = 0; i < kCount; ++i) {
        const float u_lobe = random.UniformFloat();
        const float x = random.UniformFloat();
        const BsdfSample s = bsdf->Sample(wo, {}, u_lobe, {x, random.UniformFloat()});
        const double w = s.pdf > 0 ? static_cast<double>(s.weight.y) : 0;
        sum += w;
        sum2 += w * w;
      }
      const double mean = sum / kCount;
      const double error =
          std::sqrt(std::max(0.0, sum2 / kCount - mean * mean) / kCount);
      EXPECT_NEAR(mean, 1, 4 * error + 1e-3) << name << ", cos " << cosine;
    }
  }
}

// f cos from Evaluate, integrated with uniform directions, is the albedo that sampling
// finds too: weights and values belong together.
TEST(BsdfTest, SampledWeightsIntegrateWhatEvaluateGives) {
  const Microfacet facets{Microfacet::Kind::kGgx, 0.4F};
  const std::vector<BsdfPtr> bsdfs = {
      MakeDiffuse(Grey(0.3F)),
      MakeLocalTranslucency(
          MakeRoughPlastic(PlasticOf(0.5F, false), facets), Grey(0.6F), 1.3F),
      MakeRoughPlastic(PlasticOf(0.5F, false), facets),
      MakeRoughPlastic(PlasticOf(0.5F, true), {Microfacet::Kind::kBeckmann, 0.4F}),
      MakeRoughConductor({{0.2F, 0.9F, 1.1F}, {3.9F, 2.4F, 2.1F}, Grey(1), false},
                         facets)};
  for (const BsdfPtr& bsdf : bsdfs) {
    const Vec3 wo = DirectionOf(0.6F);
    RandomStream random(3, 4);
    constexpr int kCount = 200000;
    double sampled = 0;
    double integrated = 0;
    double integrated2 = 0;
    for (int i = 0; i < kCount; ++i) {
      const float u_lobe = random.UniformFloat();
      const float x = random.UniformFloat();
      const Vec2 u{x, random.UniformFloat()};
      const BsdfSample s = bsdf->Sample(wo, {}, u_lobe, u);
      sampled += s.pdf > 0 ? static_cast<double>(s.weight.x) : 0;
      Vec3 wi = SquareToSphere(u);
      wi.z = std::abs(wi.z);
      const double f = static_cast<double>(bsdf->Evaluate(wo, wi, {}).value.x) *
                       (2 * std::numbers::pi);
      integrated += f;
      integrated2 += f * f;
    }
    const double mean = integrated / kCount;
    const double error = std::sqrt((integrated2 / kCount - mean * mean) / kCount);
    EXPECT_NEAR(sampled / kCount, mean, 5 * error + 1e-4);
  }
}

// Pearson's test: directions fall into cells of the hemisphere as their density says.
double ChiSquarePerCell(const Bsdf& bsdf, Vec3 wo) {
  constexpr int kRows = 10;
  constexpr int kColumns = 20;
  constexpr int kCount = 200000;
  constexpr int kSub = 12;
  std::vector<double> found(kRows * kColumns, 0);
  std::vector<double> expected(kRows * kColumns, 0);
  RandomStream random(5, 6);
  int kept = 0;
  for (int i = 0; i < kCount; ++i) {
    const float u_lobe = random.UniformFloat();
    const float x = random.UniformFloat();
    const BsdfSample s = bsdf.Sample(wo, {}, u_lobe, {x, random.UniformFloat()});
    if (!(s.pdf > 0)) {
      continue;
    }
    ++kept;
    const double phi =
        std::atan2(static_cast<double>(s.wi.y), static_cast<double>(s.wi.x)) /
            (2 * std::numbers::pi) +
        0.5;
    const int row = std::min(kRows - 1, static_cast<int>(s.wi.z * kRows));
    const int column = std::min(kColumns - 1, static_cast<int>(phi * kColumns));
    found[static_cast<std::size_t>(row * kColumns + column)] += 1;
  }
  // Cells of equal solid angle, each integrated on a grid of its own.
  const double cell_solid_angle = 2 * std::numbers::pi / (kRows * kColumns);
  for (int row = 0; row < kRows * kSub; ++row) {
    for (int column = 0; column < kColumns * kSub; ++column) {
      const float z = (static_cast<float>(row) + 0.5F) / (kRows * kSub);
      const float phi =
          ((static_cast<float>(column) + 0.5F) / (kColumns * kSub) - 0.5F) * 2 * kPi;
      const float r = std::sqrt(1 - z * z);
      const Vec3 wi{r * std::cos(phi), r * std::sin(phi), z};
      expected[static_cast<std::size_t>(row / kSub * kColumns + column / kSub)] +=
          kCount * static_cast<double>(bsdf.Evaluate(wo, wi, {}).pdf) *
          cell_solid_angle / (kSub * kSub);
    }
  }
  double chi2 = 0;
  int cells = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (expected[i] > 20) {
      chi2 += (found[i] - expected[i]) * (found[i] - expected[i]) / expected[i];
      ++cells;
    }
  }
  return chi2 / cells;
}

TEST(BsdfTest, DirectionsFollowTheirDensity) {
  const std::vector<std::pair<std::string, BsdfPtr>> bsdfs = {
      {"diffuse", MakeDiffuse(Grey(0.5F))},
      {"roughplastic ggx",
       MakeRoughPlastic(PlasticOf(0.3F, false), {Microfacet::Kind::kGgx, 0.6F})},
      {"roughplastic beckmann",
       MakeRoughPlastic(PlasticOf(0.3F, false), {Microfacet::Kind::kBeckmann, 0.6F})},
      {"roughplastic black",
       MakeRoughPlastic(PlasticOf(0, false), {Microfacet::Kind::kGgx, 0.5F})},
      {"roughconductor ggx",
       MakeRoughConductor({.specular_reflectance = Grey(1), .perfect = true},
                          {Microfacet::Kind::kGgx, 0.5F})},
      {"roughconductor beckmann",
       MakeRoughConductor({.specular_reflectance = Grey(1), .perfect = true},
                          {Microfacet::Kind::kBeckmann, 0.6F})}};
  for (const auto& [name, bsdf] : bsdfs) {
    for (const float cosine : {0.95F, 0.5F}) {
      // 200 cells: chi² a cell has standard deviation 0.1, and the midpoint rule adds a
      // little. A wrong factor in a density gives tens.
      EXPECT_LT(ChiSquarePerCell(*bsdf, DirectionOf(cosine)), 1.5)
          << name << ", cos " << cosine;
    }
  }
}

TEST(BsdfTest, ReflectionIsReciprocal) {
  const Microfacet facets{Microfacet::Kind::kGgx, 0.3F};
  const std::vector<BsdfPtr> bsdfs = {
      MakeDiffuse(Grey(0.4F)),
      MakeLocalTranslucency(
          MakeRoughPlastic(PlasticOf(0.5F, false), facets), Grey(0.6F), 1.3F),
      MakePlastic(PlasticOf(0.5F, true)),
      MakeRoughPlastic(PlasticOf(0.5F, true), facets),
      MakeRoughConductor({{0.2F, 0.9F, 1.1F}, {3.9F, 2.4F, 2.1F}, Grey(1), false},
                         facets)};
  const Vec3 a = Normalized(Vec3{0.3F, 0.2F, 0.9F});
  const Vec3 b = Normalized(Vec3{-0.5F, 0.4F, 0.4F});
  for (const BsdfPtr& bsdf : bsdfs) {
    const float ab = bsdf->Evaluate(a, b, {}).value.x / b.z;
    const float ba = bsdf->Evaluate(b, a, {}).value.x / a.z;
    EXPECT_NEAR(ab, ba, 1e-5F * ab);
    EXPECT_GT(ab, 0);
  }
}

TEST(BsdfTest, OneSidedOnesAreBlackFromBehindAndTwoSidedOnesAreNot) {
  const BsdfPtr front = MakeDiffuse(Grey(0.5F));
  const Vec3 up{0, 0, 1};
  EXPECT_EQ(front->Evaluate(-up, -up, {}).value.x, 0);
  EXPECT_EQ(front->Sample(-up, {}, 0.5F, {0.3F, 0.3F}).pdf, 0);
  const BsdfPtr both = MakeTwoSided(front);
  EXPECT_NEAR(both->Evaluate(-up, -up, {}).value.x, 0.5F * kInvPi, 1e-6);
  EXPECT_EQ(both->Evaluate(-up, up, {}).value.x, 0);
  EXPECT_LT(both->Sample(-up, {}, 0.5F, {0.3F, 0.3F}).wi.z, 0);
}

TEST(BsdfTest, DielectricRefractsBySnellAndKeepsRadianceOverIndexSquared) {
  const BsdfPtr glass = MakeDielectric({1.5F, Grey(1), Grey(1)});
  const Vec3 wo = DirectionOf(0.8F);
  const BsdfSample in = glass->Sample(wo, {}, 0.99F, {});
  EXPECT_NEAR(std::hypot(in.wi.x, in.wi.y), 0.6F / 1.5F, 1e-6);
  EXPECT_LT(in.wi.z, 0);
  EXPECT_NEAR(in.weight.x, 1 / 2.25F, 1e-6);
  const BsdfSample out = glass->Sample(in.wi, {}, 0.99F, {});
  EXPECT_NEAR(out.wi.z, 0.8F, 1e-6);
  EXPECT_NEAR(in.weight.x * out.weight.x, 1, 1e-6);
  // Beyond the critical angle everything is reflected.
  const BsdfSample total = glass->Sample({0.8F, 0, -0.6F}, {}, 0.9999F, {});
  EXPECT_NEAR(total.wi.z, -0.6F, 1e-6);
}

// Over both sides: flux is kept by Sample (weights undone by η² where light refracts),
// follows its density, and crosses both ways alike: f(a → b) / η_b² is symmetric.
class RoughGlassTest : public ::testing::TestWithParam<Microfacet> {
 protected:
  static constexpr float kEta = 1.5F;
  BsdfPtr glass_ = MakeRoughDielectric({kEta, Grey(1), Grey(1)}, GetParam());
};

TEST_P(RoughGlassTest, KeepsFlux) {
  for (const float cosine : {0.999F, 0.6F, 0.2F, -0.2F, -0.6F, -0.999F}) {
    const Vec3 wo = DirectionOf(cosine);
    RandomStream random(7, 2);
    constexpr int kCount = 60000;
    double sum = 0;
    double sum2 = 0;
    for (int i = 0; i < kCount; ++i) {
      const float u_lobe = random.UniformFloat();
      const float x = random.UniformFloat();
      const BsdfSample s = glass_->Sample(wo, {}, u_lobe, {x, random.UniformFloat()});
      const double w = s.pdf > 0 ? static_cast<double>(s.weight.y * s.eta * s.eta) : 0;
      sum += w;
      sum2 += w * w;
    }
    const double mean = sum / kCount;
    const double error = std::sqrt(std::max(0.0, sum2 / kCount - mean * mean) / kCount);
    EXPECT_NEAR(mean, 1, 4 * error + 2e-3) << cosine;
  }
}

TEST_P(RoughGlassTest, DirectionsFollowTheirDensity) {
  for (const float cosine : {0.7F, -0.9F}) {
    const Vec3 wo = DirectionOf(cosine);
    // Of directions by Sample, and by uniform directions weighted with the density: the
    // share in each octant.
    std::array<double, 8> drawn{};
    std::array<double, 8> expected{};
    std::array<double, 8> squares{};
    RandomStream random(8, 2);
    constexpr int kCount = 400000;
    const auto octant = [](Vec3 w) {
      return static_cast<std::size_t>((w.x > 0) + 2 * (w.y > 0) + 4 * (w.z > 0));
    };
    for (int i = 0; i < kCount; ++i) {
      const float u_lobe = random.UniformFloat();
      const float x = random.UniformFloat();
      const Vec2 u{x, random.UniformFloat()};
      const BsdfSample s = glass_->Sample(wo, {}, u_lobe, u);
      if (s.pdf > 0) {
        drawn[octant(s.wi)] += 1.0 / kCount;
      }
      const Vec3 wi = SquareToSphere(u);
      const double share =
          static_cast<double>(glass_->Evaluate(wo, wi, {}).pdf) * 4 * std::numbers::pi;
      expected[octant(wi)] += share / kCount;
      squares[octant(wi)] += share * share / kCount;
    }
    for (std::size_t k = 0; k < 8; ++k) {
      EXPECT_NEAR(drawn[k], expected[k], 4 * std::sqrt(squares[k] / kCount) + 1e-3)
          << cosine << ", octant " << k;
    }
  }
}

TEST_P(RoughGlassTest, IsReciprocal) {
  const Vec3 above = Normalized(Vec3{0.3F, 0.2F, 0.9F});
  const Vec3 below = Normalized(Vec3{-0.25F, -0.1F, -0.8F});
  const Vec3 beside = Normalized(Vec3{-0.4F, 0.1F, 0.5F});
  const auto f = [&](Vec3 wo, Vec3 wi) {
    return glass_->Evaluate(wo, wi, {}).value.x / std::abs(wi.z);
  };
  EXPECT_GT(f(above, below), 0);
  // Radiance over η² is what is kept: [Veach97, Eq. 5.14].
  EXPECT_NEAR(f(above, below) * kEta * kEta, f(below, above), 2e-3F * f(below, above));
  EXPECT_NEAR(f(above, beside), f(beside, above), 1e-4F * f(above, beside));
}

INSTANTIATE_TEST_SUITE_P(Facets,
                         RoughGlassTest,
                         ::testing::Values(Microfacet{Microfacet::Kind::kGgx, 0.3F},
                                           Microfacet{Microfacet::Kind::kGgx, 0.8F},
                                           Microfacet{Microfacet::Kind::kBeckmann,
                                                      0.4F}));

TEST(FresnelTest, SinglePrecisionAgreesWithTheDoubleOne) {
  for (const float eta : {1 / 1.5F, 1.0F, 1.3F, 1.5F, 2.4F}) {
    for (float mu = 0.02F; mu <= 1; mu += 0.02F) {
      EXPECT_NEAR(static_cast<double>(FresnelDielectric(mu, eta)),
                  FresnelReflectance(static_cast<double>(mu), static_cast<double>(eta)),
                  3e-6)
          << mu << ' ' << eta;
    }
  }
  EXPECT_NEAR(FresnelDielectric(1, 1.5F), 0.04F, 1e-6);
}

TEST(FresnelTest, ConductorsAtNormalIncidenceAndGrazing) {
  // ((η − 1)² + k²) / ((η + 1)² + k²): gold's red and blue.
  EXPECT_NEAR(FresnelConductor(1, 0.143F, 3.983F), 0.96669F, 2e-4);
  EXPECT_NEAR(FresnelConductor(1, 1.442F, 1.603F), 0.32403F, 2e-4);
  EXPECT_NEAR(FresnelConductor(0, 1.442F, 1.603F), 1, 1e-5);
  // Without absorption it is a dielectric.
  for (float mu = 0.1F; mu < 1; mu += 0.1F) {
    EXPECT_NEAR(FresnelConductor(mu, 1.5F, 0), FresnelDielectric(mu, 1.5F), 1e-5);
  }
}

TEST(AlbedoTableTest, ASmoothInterfaceReflectsByFresnel) {
  const AlbedoTable table({Microfacet::Kind::kGgx, 0.002F},
                          [](float mu) { return FresnelDielectric(mu, 1.5F); });
  for (const float mu : {0.3F, 0.6F, 1.0F}) {
    EXPECT_NEAR(table(mu), FresnelDielectric(mu, 1.5F), 2e-3F);
  }
  EXPECT_NEAR(static_cast<double>(table.Mean()), DiffuseFresnelReflectance(1.5), 2e-3);
}

}  // namespace
}  // namespace nacre::render
