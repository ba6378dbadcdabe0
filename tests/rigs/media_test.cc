#include "rigs/media.h"

#include "rigs/media_skin.h"
#include "rigs/transport/dipole.h"

#include <gtest/gtest.h>

#include <array>
#include <set>
#include <string>

namespace nacre::rigs {
namespace {

// [Jensen01, fig. 5] prints the diffuse reflectance beside the coefficients: the dipole
// must give it back. Ketchup and the blue of chicken don't follow in the paper either.
TEST(Media, JensensCoefficientsGiveHisReflectances) {
  struct Printed {
    const char* name;
    std::array<double, 3> reflectance;
  };
  constexpr std::array kPrinted = {
      Printed{"apple", {0.85, 0.84, 0.53}},
      Printed{"chicken1", {0.31, 0.15, -1}},
      Printed{"chicken2", {0.32, 0.16, -1}},
      Printed{"cream", {0.98, 0.90, 0.73}},
      Printed{"marble", {0.83, 0.79, 0.75}},
      Printed{"potato", {0.77, 0.62, 0.21}},
      Printed{"skimmilk", {0.81, 0.81, 0.69}},
      Printed{"skin1", {0.44, 0.22, 0.13}},
      Printed{"skin2", {0.63, 0.44, 0.34}},
      Printed{"spectralon", {1, 1, 1}},
      Printed{"wholemilk", {0.91, 0.88, 0.76}},
  };
  for (const Printed& p : kPrinted) {
    const NamedMedium* const medium = FindNamedMedium(p.name);
    ASSERT_NE(medium, nullptr) << p.name;
    EXPECT_EQ(medium->source, "Jensen01");
    for (std::size_t c = 0; c < 3; ++c) {
      const Dipole dipole(
          {medium->sigma_a_per_mm[c], medium->reduced_sigma_s_per_mm[c]},
          BoundaryFactor(medium->eta));
      if (p.reflectance[c] >= 0) {
        EXPECT_NEAR(dipole.TotalReflectance(), p.reflectance[c], 0.0095)
            << p.name << " " << c;
      }
    }
  }
}

TEST(Media, NamesAreDistinctAndAllAreSound) {
  std::set<std::string_view> names;
  for (const NamedMedium& medium : NamedMedia()) {
    EXPECT_TRUE(names.insert(medium.name).second) << medium.name;
    EXPECT_GE(medium.eta, 1.3);
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_GT(medium.reduced_sigma_s_per_mm[c], 0);
      EXPECT_GE(medium.sigma_a_per_mm[c], 0);
    }
  }
  EXPECT_EQ(FindNamedMedium("Marble"), nullptr);
  EXPECT_NE(NamedMediaList().find("apple, chicken1, "), std::string::npos);
}

// Worked out by hand from the published laws.
TEST(Skin, LawsGiveTheirPublishedValues) {
  EXPECT_NEAR(EumelaninAbsorption(694), 22.79, 0.02);  // 228 /cm [Jacques98]
  EXPECT_NEAR(PheomelaninAbsorption(500), 43.882, 1e-3);
  EXPECT_NEAR(BaselineAbsorption(500), 0.0702, 2e-4);
  // 2.303 · ε · 150 / 64500 /cm.
  EXPECT_NEAR(OxyHaemoglobinAbsorption(650), 0.1971, 1e-4);
  EXPECT_NEAR(DeoxyHaemoglobinAbsorption(650), 2.0085, 1e-3);
  EXPECT_NEAR(OxyHaemoglobinAbsorption(540), 28.51, 0.01);
  EXPECT_NEAR(EpidermisReducedScattering(500), 14.74 * 0.25482 + 3.52, 2e-3);
  EXPECT_EQ(DermisReducedScattering(600), 0.5 * EpidermisReducedScattering(600));
}

TEST(Skin, FractionsMixTheChromophores) {
  SkinModel skin;
  skin.melanin_fraction = 0;
  skin.haemoglobin_fraction = 0;
  EXPECT_EQ(EpidermisAbsorption(skin, 550), BaselineAbsorption(550));
  EXPECT_EQ(DermisAbsorption(skin, 550), BaselineAbsorption(550));
  skin.melanin_fraction = 1;
  skin.eumelanin_share = 1;
  skin.haemoglobin_fraction = 1;
  skin.oxygenation = 0;
  EXPECT_DOUBLE_EQ(EpidermisAbsorption(skin, 550), EumelaninAbsorption(550));
  EXPECT_DOUBLE_EQ(DermisAbsorption(skin, 550), DeoxyHaemoglobinAbsorption(550));
  skin.eumelanin_share = 0;
  skin.oxygenation = 1;
  EXPECT_DOUBLE_EQ(EpidermisAbsorption(skin, 550), PheomelaninAbsorption(550));
  EXPECT_DOUBLE_EQ(DermisAbsorption(skin, 550), OxyHaemoglobinAbsorption(550));
  // Between entries of the table: between their values, and continuous.
  EXPECT_LT(OxyHaemoglobinAbsorption(545), OxyHaemoglobinAbsorption(540));
  EXPECT_GT(OxyHaemoglobinAbsorption(545), OxyHaemoglobinAbsorption(550));
  EXPECT_NEAR(OxyHaemoglobinAbsorption(719.9999), OxyHaemoglobinAbsorption(720), 1e-6);
}

}  // namespace
}  // namespace nacre::rigs
