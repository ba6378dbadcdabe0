// Participating media: laws with a closed form, and published slabs.
#include "render/named_media.h"
#include "render/volume_file.h"
#include "tests/render/scene_text.h"
#include "tests/support/temp_folder.h"

#include <gmock/gmock.h>

#include <fstream>

namespace nacre::render::testing {
namespace {

using nacre::testing::TempFolder;
using ::testing::HasSubstr;

const char* const kWhiteSky =
    R"(<emitter type="constant"><rgb name="radiance" value="1"/></emitter>)";

std::string Medium(const std::string& sigma_s, const std::string& sigma_a, double g) {
  return R"(<medium type="homogeneous" name="interior"><rgb name="sigmaS" value=")" +
         sigma_s + R"("/><rgb name="sigmaA" value=")" + sigma_a +
         R"("/><phase type="hg"><float name="g" value=")" + std::to_string(g) +
         R"("/></phase></medium>)";
}

// A box of that half size around the origin.
std::string Box(const std::string& inside, const std::string& half = "1") {
  return R"(<shape type="cube"><transform name="toWorld"><scale value=")" + half +
         R"("/></transform>)" + inside + "</shape>";
}

// Each channel's mean over a narrow view along −z.
Statistics Seen(const std::string& body, std::size_t channel, int spp = 1024) {
  std::string text = SceneText(body, "0, 0, 5", "0, 0, 0", 4);
  text.replace(text.find("value=\"20\""), 10, "value=\"0.5\"");
  RenderOptions options;
  options.spp = spp;
  return ChannelStatistics(Render(Parse(text), options).image, channel);
}

// The grid of one value that fills [−1, 1]³, as a file.
std::filesystem::path ConstantGrid(const TempFolder& folder, float value) {
  const std::filesystem::path path = folder.path() / "grid.vol";
  std::ofstream file(path, std::ios::binary);
  const auto put = [&](auto v) {
    file.write(reinterpret_cast<const char*>(&v), sizeof v);
  };
  file.write("VOL\3", 4);
  for (const std::int32_t n : {1, 2, 3, 2, 1}) {
    put(n);
  }
  for (const float corner : {-1.0F, -1.0F, -1.0F, 1.0F, 1.0F, 1.0F}) {
    put(corner);
  }
  for (int i = 0; i < 12; ++i) {
    put(value);
  }
  return path;
}

std::string GridMedium(const std::filesystem::path& density, double albedo) {
  return R"(<medium type="heterogeneous" name="interior"><float name="scale" value="2"/>
    <volume type="gridvolume" name="density"><string name="filename" value=")" +
         density.string() + R"("/></volume>
    <volume type="constvolume" name="albedo"><float name="value" value=")" +
         std::to_string(albedo) + R"("/></volume></medium>)";
}

TEST(MediaTest, AbsorptionIsBeersLaw) {
  const std::string scene = kWhiteSky + Box(Medium("0", "0.2, 0.7, 3", 0));
  for (std::size_t c = 0; c < 3; ++c) {
    const double sigma = std::array{0.2, 0.7, 3.0}[c];
    const Statistics seen = Seen(scene, c);
    EXPECT_NEAR(seen.mean, std::exp(-2 * sigma), 4 * seen.standard_error + 1e-6);
  }
  const TempFolder folder;
  const Statistics seen =
      Seen(kWhiteSky + Box(GridMedium(ConstantGrid(folder, 0.4F), 0)), 1, 4096);
  EXPECT_NEAR(seen.mean, std::exp(-2 * 0.8), 4 * seen.standard_error + 1e-6);
}

// In a furnace, matter that only scatters can't be seen, whatever is around it.
TEST(MediaTest, WhiteFurnace) {
  const TempFolder folder;
  const std::vector<std::string> insides = {
      Medium("3, 1, 0.3", "0", 0),
      Medium("3, 1, 0.3", "0", 0.8),
      GridMedium(ConstantGrid(folder, 0.7F), 1),
      Medium("1, 2, 3", "0", 0.5) + "<bsdf type=\"dielectric\"/>",
      Medium("1, 2, 3", "0", -0.5) +
          "<bsdf type=\"roughdielectric\"><float name=\"alpha\" "
          "value=\"0.4\"/></bsdf>"};
  for (const std::string& inside : insides) {
    for (const std::size_t c : {0, 2}) {
      const Statistics seen = Seen(kWhiteSky + Box(inside), c, 512);
      EXPECT_NEAR(seen.mean, 1, 4 * seen.standard_error + 3e-3) << inside;
    }
  }
}

// [van de Hulst 80, volume 2, table 35]: optical thickness 2, albedo 0.9, g 0.75, index
// 1: R = 0.09739, T = 0.66096 for light along the normal. By reciprocity that is what
// an eye along the normal sees of a slab under an even sky, above and below it.
TEST(MediaTest, SlabReflectsAndTransmitsAsPublished) {
  const auto scene = [](const std::string& lamp_z, const std::string& turn) {
    return R"(<shape type="rectangle"><emitter type="area"><rgb name="radiance" value="1"/>
      </emitter><transform name="toWorld"><scale value="3000"/>)" +
           turn + R"(<translate z=")" + lamp_z + R"("/></transform></shape>
      <shape type="cube"><transform name="toWorld"><scale x="60" y="60" z="1"/></transform>)" +
           Medium("0.9", "0.1", 0.75) + "</shape>";
  };
  const Statistics reflected =
      Seen(scene("7", "<rotate y=\"1\" angle=\"180\"/>"), 1, 8192);
  EXPECT_NEAR(reflected.mean, 0.09739, 4 * reflected.standard_error + 2e-4);
  EXPECT_LT(reflected.standard_error, 1e-3);
  const Statistics transmitted = Seen(scene("-2", ""), 1, 8192);
  EXPECT_NEAR(transmitted.mean, 0.66096, 4 * transmitted.standard_error + 1e-3);
  EXPECT_LT(transmitted.standard_error, 3e-3);
}

// A lamp that only light sampling finds, seen through and by the medium: an even grid
// is the homogeneous medium.
TEST(MediaTest, AnEvenGridIsTheHomogeneousMedium) {
  const std::string lamp = R"(<emitter type="point"><point name="position" x="3" y="1"
    z="2"/><rgb name="intensity" value="20"/></emitter>)";
  const TempFolder folder;
  const Statistics grid =
      Seen(lamp + Box(GridMedium(ConstantGrid(folder, 0.5F), 0.8)), 1, 4096);
  const Statistics even = Seen(lamp + Box(Medium("0.8", "0.2", 0)), 1, 4096);
  EXPECT_GT(even.mean, 0.01);
  EXPECT_NEAR(grid.mean, even.mean, 4 * (grid.standard_error + even.standard_error));
}

TEST(MediaTest, WrongOnesAreNamed) {
  const auto error = [](const std::string& inside) {
    return ReaderError(SceneText(Box(inside)));
  };
  EXPECT_THAT(error("<medium name=\"interior\" type=\"homogenous\"/>"),
              HasSubstr("no medium 'homogenous'; did you mean 'homogeneous'?"));
  EXPECT_THAT(error("<medium name=\"interior\" type=\"homogeneous\"/>"),
              HasSubstr("give one of: 'material'"));
  EXPECT_THAT(error("<ref name=\"interior\" id=\"fog\"/>"),
              HasSubstr("no medium with id 'fog'"));
  EXPECT_THAT(error("<medium name=\"interior\" type=\"heterogeneous\"/>"),
              HasSubstr("needs the volumes"));
}

TEST(VolumeFileTest, RefusesWhatIsCutShortOrNoNumber) {
  const TempFolder folder;
  const auto error = [&](const std::filesystem::path& path) -> std::string {
    try {
      ReadVolumeFile(path);
    } catch (const Error& e) {
      return e.what();
    }
    return "no error";
  };
  EXPECT_EQ(ReadVolumeFile(ConstantGrid(folder, 2)).values.size(), 12);
  EXPECT_THAT(error(ConstantGrid(folder, -1)), HasSubstr("a value of -1"));
  EXPECT_THAT(error(ConstantGrid(folder, std::nanf(""))), HasSubstr("a value of"));
  const std::filesystem::path path = ConstantGrid(folder, 1);
  std::filesystem::resize_file(path, 90);
  EXPECT_THAT(error(path), HasSubstr("12 values announced, 42 bytes follow"));
  std::filesystem::resize_file(path, 20);
  EXPECT_THAT(error(path), HasSubstr("not a volume"));
}

// Total reflectances of the dipole with Jensen's F_dr polynomial agree with the table
// that the paper prints beside the coefficients; ketchup and chicken's blue don't in
// the paper itself.
TEST(NamedMediaTest, ReproduceTheReflectancesOfThePaper) {
  const std::map<std::string, Color> printed = {{"apple", {0.85F, 0.84F, 0.53F}},
                                                {"chicken1", {0.31F, 0.15F, -1}},
                                                {"chicken2", {0.32F, 0.16F, 0.10F}},
                                                {"cream", {0.98F, 0.90F, 0.73F}},
                                                {"marble", {0.83F, 0.79F, 0.75F}},
                                                {"potato", {0.77F, 0.62F, 0.21F}},
                                                {"skimmilk", {0.81F, 0.81F, 0.69F}},
                                                {"skin1", {0.44F, 0.22F, 0.13F}},
                                                {"skin2", {0.63F, 0.44F, 0.34F}},
                                                {"spectralon", {1, 1, 1}},
                                                {"wholemilk", {0.91F, 0.88F, 0.76F}}};
  for (const auto& [name, reflectance] : printed) {
    const auto medium = FindNamedMedium(name);
    ASSERT_TRUE(medium.has_value()) << name;
    const double eta = static_cast<double>(medium->eta);
    const double fdr = -1.440 / (eta * eta) + 0.710 / eta + 0.668 + 0.0636 * eta;
    const double a = (1 + fdr) / (1 - fdr);
    for (int c = 0; c < 3; ++c) {
      const double ss = static_cast<double>(medium->SigmaSPrime()[c]);
      const double sa = static_cast<double>(medium->sigma_a_per_mm[c]);
      const double albedo = ss / (ss + sa);
      const double root = std::sqrt(3 * (1 - albedo));
      const double total =
          albedo / 2 * (1 + std::exp(-4 * a / 3 * root)) * std::exp(-root);
      if (reflectance[c] >= 0) {
        EXPECT_NEAR(total, static_cast<double>(reflectance[c]), 0.0085)
            << name << ' ' << c;
      }
    }
  }
}

// The reduced coefficients that pbrt prints for media of Narasimhan et al. 2006 are
// those of the scattering and the asymmetry here.
TEST(NamedMediaTest, ReducedScatteringIsThatOfAnotherProgram) {
  EXPECT_EQ(NamedMediaNames().size(), 12u + 35);
  const std::map<std::string, Color> reduced = {
      {"Lowfat Milk", {0.89187F, 1.5136F, 2.532F}},
      {"regularmilk", {4.5513F, 5.8294F, 7.136F}},
      {"Espresso", {0.72378F, 0.84557F, 1.0247F}},
      {"White Grapefruit Juice", {0.22826F, 0.23998F, 0.32748F}},
      {"cappuccino powder", {1.8436F, 2.5851F, 2.1662F}},
      {"suisse_mocha_powder", {2.7979F, 3.5452F, 4.3365F}}};
  for (const auto& [name, expected] : reduced) {
    const auto medium = FindNamedMedium(name);
    ASSERT_TRUE(medium.has_value()) << name;
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(medium->SigmaSPrime()[c] / expected[c], 1, 2e-4F) << name << c;
    }
  }
  EXPECT_FALSE(FindNamedMedium("mlik").has_value());
}

}  // namespace
}  // namespace nacre::render::testing
