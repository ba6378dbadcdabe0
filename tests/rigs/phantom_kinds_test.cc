// Phantoms of every kind: what their files say is what Monte Carlo is given.
#include "core/atomic_file.h"
#include "core/error.h"
#include "rigs/phantom.h"
#include "rigs/phantom_inclusions.h"
#include "rigs/transport/diffusion/diffusion_transport.h"
#include "rigs/transport/monte_carlo/monte_carlo.h"
#include "rigs/transport/path_averaged.h"
#include "tests/support/temp_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

namespace nacre::rigs {
namespace {

using monte_carlo::MakeVolume;
using monte_carlo::Result;
using monte_carlo::Volume;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

const std::string kFolder = std::string(NACRE_RIGS_FOLDER) + "/";

Result Simulate(const Phantom& phantom, std::size_t channel, std::int64_t photons) {
  const PointMm x_i{2.3, 1.2};  // nowhere special
  return monte_carlo::Simulate(MakeVolume(phantom, channel),
                               monte_carlo::MakeSource(phantom.beam, x_i),
                               {},
                               {.photon_count = photons});
}

TEST(PhantomKinds, EveryShippedOneIsSimulated) {
  for (const char* name : {"chessboard4x4.toml",
                           "stripes.toml",
                           "layers.toml",
                           "skin.toml",
                           "marble.toml",
                           "marble-flat.toml",
                           "onyx.toml",
                           "inclusions.toml",
                           "voxels.toml",
                           "images.toml"}) {
    const Phantom phantom = ReadPhantom(kFolder + name);
    ASSERT_EQ(phantom.channels.size(), 3u) << name;
    EXPECT_GT(phantom.grid.points_x, 0) << name;
    for (std::size_t c = 0; c < 3; ++c) {
      const Result r = Simulate(phantom, c, 2000);
      EXPECT_DOUBLE_EQ(
          r.reflected.mean + r.transmitted.mean + r.absorbed.mean + r.backing.mean, 1)
          << name;
      EXPECT_GT(r.reflected.mean, 0.01) << name;
      EXPECT_LT(r.reflected.mean, 0.99) << name;
    }
  }
}

TEST(PhantomKinds, OtherSolversSayWhatTheyCanNotDo) {
  for (const char* name : {"layers.toml",
                           "skin.toml",
                           "marble.toml",
                           "onyx.toml",
                           "inclusions.toml",
                           "voxels.toml"}) {
    const Phantom phantom = ReadPhantom(kFolder + name);
    EXPECT_THAT([&] { PathAveraged{phantom}; },
                ThrowsMessage<Error>(HasSubstr("--solver mc")))
        << name;
    EXPECT_THAT([&] { DiffusionTransport(phantom, {}); },
                ThrowsMessage<Error>(HasSubstr("--solver mc")))
        << name;
  }
}

// A plane mixture is one phantom to both solvers: over x_i in vein and ground alike the
// fast model's R must go with Monte Carlo's.
TEST(PhantomKinds, TheFastSolverDoesPlaneMixtures) {
  const Phantom phantom = ReadPhantom(kFolder + "marble-flat.toml");
  ASSERT_EQ(phantom.pattern.type, PatternType::kMixture);
  const PathAveraged fast(phantom);
  const Volume volume = MakeVolume(phantom, 0);
  for (const PointMm x_i : {PointMm{0, 0}, {12, -7}, {-15, 20}, {5, 18}}) {
    const Result r =
        monte_carlo::Simulate(volume, {.centre = x_i}, {}, {.photon_count = 20'000});
    EXPECT_NEAR(fast.TotalsAt(x_i, 0).reflected, r.reflected.mean, 0.08) << x_i.x;
  }
}

// MCML's three layers (its manual's tables 6.6 and 6.7), by adding-doubling: 0.237856
// of the arriving light comes back without the specular part, 0.096048 comes through.
TEST(PhantomKinds, LayersAreThoseOfTheFile) {
  const Phantom phantom = ParsePhantom(
      "[slab]\neta = 1.37\n"
      "[[medium]]\nname = \"a\"\nsigma_a_per_mm = 0.1\nsigma_s_per_mm = 10\ng = 0.9\n"
      "[[medium]]\nname = \"b\"\nsigma_a_per_mm = 0.1\nsigma_s_per_mm = 1\n"
      "[[medium]]\nname = \"c\"\nsigma_a_per_mm = 0.2\nreduced_sigma_s_per_mm = 0.3\n"
      "g = 0.7\n"
      "[[layer]]\nmedium = \"a\"\nthickness_mm = 1\n"
      "[[layer]]\nmedium = \"b\"\nthickness_mm = 1\n"
      "[[layer]]\nmedium = \"c\"\nthickness_mm = 2\n",
      "p.toml");
  EXPECT_EQ(phantom.slab.thickness_mm, 4);
  EXPECT_EQ(phantom.slab.eta, 1.37);
  EXPECT_NEAR(phantom.media[2].sigma_s_per_mm[0], 1, 1e-12);
  const Result r = Simulate(phantom, 0, 400'000);
  const double entered = 1 - r.specular;
  EXPECT_NEAR(r.reflected.mean * entered, 0.237856, 3.5 * r.reflected.se);
  EXPECT_NEAR(r.transmitted.mean * entered, 0.096048, 3.5 * r.transmitted.se);
}

TEST(PhantomKinds, LayersShareTheSlab) {
  const Phantom phantom = ReadPhantom(kFolder + "layers.toml");
  ASSERT_EQ(phantom.layers.size(), 3u);
  EXPECT_EQ(phantom.slab.eta, 1.46);
  EXPECT_NEAR(phantom.layers[2].thickness_mm, 6.8, 1e-12);
  EXPECT_EQ(phantom.layers[1].medium, 1u);
  EXPECT_NEAR(phantom.media[1].ReducedScattering(0), 2.55, 1e-12);
  const Volume volume = MakeVolume(phantom, 1);
  EXPECT_EQ(volume.layers[1].eta, 1.35);
  EXPECT_NEAR(volume.DepthMm(), 8, 1e-12);
}

// What everyone knows of skin.
TEST(PhantomKinds, SkinReddensAndDarkens) {
  const auto skin = [](const std::string& keys) {
    return ParsePhantom(
        "[slab]\nbottom = \"black\"\nthickness_mm = 20\n[skin]\n" + keys, "s.toml");
  };
  const auto reflectances = [](const Phantom& phantom) {
    std::array<double, 3> r{};
    for (std::size_t c = 0; c < 3; ++c) {
      r[c] = Simulate(phantom, c, 40'000).reflected.mean;
    }
    return r;
  };
  const auto fair = reflectances(skin("melanin_fraction = 0.02\n"));
  const auto dark = reflectances(skin("melanin_fraction = 0.3\n"));
  const auto bloodless =
      reflectances(skin("melanin_fraction = 0.02\nhaemoglobin_fraction = 0\n"));
  const auto blue_blood = reflectances(
      skin("melanin_fraction = 0.02\noxygenation = 0\nhaemoglobin_fraction = 0.05\n"));
  EXPECT_GT(fair[0], fair[1] + 0.05);
  EXPECT_GT(fair[0], fair[2] + 0.05);
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_GT(fair[c], dark[c] + 0.05);
  }
  EXPECT_GT(bloodless[1], fair[1] + 0.03);
  EXPECT_LT(bloodless[0] - fair[0], bloodless[1] - fair[1]);
  EXPECT_LT(blue_blood[0], fair[0] - 0.05);
  const Phantom phantom = skin("wavelengths_nm = [640, 540, 460]\n");
  EXPECT_EQ(phantom.slab.eta, 1.4);
  EXPECT_EQ(phantom.layers[1].eta, 1.38);
  EXPECT_EQ(phantom.layers[1].thickness_mm, 19.75);
}

TEST(PhantomKinds, NamedMedia) {
  const Phantom phantom =
      ParsePhantom("medium = \"marble\"\n[slab]\nthickness_mm = 10\n", "p.toml");
  EXPECT_EQ(phantom.slab.eta, 1.5);
  EXPECT_THAT(phantom.channels, ElementsAre("R", "G", "B"));
  EXPECT_THAT(phantom.media[0].sigma_s_per_mm, ElementsAre(2.19, 2.62, 3.00));
  const Phantom two = ParsePhantom(
      "channels = [\"B\", \"R\"]\nmedium = [\"skin1\", \"chicken1\"]\n"
      "[slab]\nthickness_mm = 10\neta = 1.4\n"
      "[pattern]\ntype = \"stripes\"\ncell_mm = 2\n",
      "p.toml");
  EXPECT_EQ(two.slab.eta, 1.4);
  EXPECT_THAT(two.media[1].sigma_a_per_mm, ElementsAre(0.19, 0.015));
}

// A voxel's place: x, then y upwards, then z downwards, centred on the origin; the
// NumPy file holds the same.
TEST(PhantomKinds, VoxelFilesKeepTheirOrder) {
  const Phantom raw = ReadPhantom(kFolder + "voxels.toml");
  const Volume volume = MakeVolume(raw, 0);
  const auto bytes = ReadPhantom(kFolder + "voxels.toml").voxels->label;
  EXPECT_EQ(bytes.size(), 480u);
  EXPECT_EQ(volume.MediumAt(0.5, 0.5, 2), 2u);  // the post in the middle
  EXPECT_EQ(volume.MediumAt(5.9, 4.9, 2), 0u);  // a corner
  EXPECT_EQ(volume.MediumAt(-3, -2, 0.5), 1u);  // steps go round with depth:
  EXPECT_EQ(volume.MediumAt(3, -2, 1.5), 1u);   // y < 0 first, which is below
  EXPECT_EQ(volume.MediumAt(3, 2, 2.5), 1u);
  EXPECT_EQ(volume.MediumAt(-3, 2, 3.5), 1u);
  EXPECT_EQ(volume.MediumAt(-3, 2, 0.5), 0u);

  const Phantom npy = ParsePhantom(
      "medium = [\"marble\", \"chicken1\", \"ketchup\"]\n"
      "[slab]\nthickness_mm = 4\neta = 1.5\n"
      "[pattern]\ntype = \"voxels\"\nfile = \"data/stair.npy\"\nvoxel_mm = 1\n",
      kFolder + "inline.toml");
  EXPECT_EQ(npy.voxels->label, raw.voxels->label);
  EXPECT_EQ(npy.voxels->layout.count, raw.voxels->layout.count);
}

TEST(PhantomKinds, PicturesHaveTheirTopAbove) {
  const Phantom phantom = ReadPhantom(kFolder + "images.toml");
  ASSERT_EQ(phantom.pattern.type, PatternType::kMixture);
  // Three arms 0.5 + 0.5 cos(3 φ + 8 r) over r = |x| / 12 mm, φ up from +x.
  for (const PointMm p : {PointMm{4.125, 2.625}, {-3.375, 4.875}, {1.875, -5.625}}) {
    const double r = std::hypot(p.x, p.y) / 12;
    const double arms = 0.5 + 0.5 * std::cos(3 * std::atan2(p.y, p.x) + 8 * r);
    EXPECT_NEAR(phantom.pattern.SecondMediumFraction(p, p),
                arms * std::clamp(1.3 - r, 0.0, 1.0),
                0.005);
  }
}

TEST(PhantomKinds, InclusionsHaveTheirVolume) {
  const VoxelLayout layout{
      .count = {80, 80, 80}, .size_mm = {0.1, 0.1, 0.1}, .left_mm = -4, .lower_mm = -4};
  const Voxels voxels = PlaceInclusions(layout,
                                        2,
                                        {{.medium = 1,
                                          .centre_mm = {1, 0, 4},
                                          .radii_mm = {2, 1, 1.5},
                                          .turn_rad = 0.5}});
  const auto inside = std::count(voxels.label.begin(), voxels.label.end(), 1);
  EXPECT_NEAR(static_cast<double>(inside) * 1e-3, 4 * std::numbers::pi / 3 * 3, 0.05);
  const auto at = [&](double x, double y, double z) {
    return voxels.label[layout.Index(static_cast<int>((x + 4) / 0.1),
                                     static_cast<int>((y + 4) / 0.1),
                                     static_cast<int>(z / 0.1))];
  };
  const double c = std::cos(0.5);
  const double s = std::sin(0.5);
  EXPECT_EQ(at(1 + 1.8 * c, 1.8 * s, 4), 1);  // turned counter-clockwise
  EXPECT_EQ(at(1 + 1.8 * c, -1.8 * s, 4), 0);
  EXPECT_EQ(at(1, 0, 5.4), 1);

  const Strewn strewn{.medium = 1,
                      .count = 500,
                      .seed = 4,
                      .smallest_mm = 0.2,
                      .largest_mm = 0.4,
                      .low_mm = {-1, -2, 0},
                      .high_mm = {1, 2, 3}};
  const std::vector<Inclusion> spheres = Strew(strewn);
  double mean_radius = 0;
  for (const Inclusion& each : spheres) {
    EXPECT_LE(std::abs(each.centre_mm[1]), 2);
    mean_radius += each.radii_mm[0] / 500;
  }
  EXPECT_NEAR(mean_radius, 0.3, 0.012);
  EXPECT_EQ(Strew(strewn).back().centre_mm, spheres.back().centre_mm);
}

// Mixing by volume: σ_a, σ_s and σ_s' are all mixed linearly, whatever the g.
TEST(PhantomKinds, MixturesKeepReducedScattering) {
  const Phantom phantom = ParsePhantom(
      "[slab]\nthickness_mm = 5\neta = 1.5\n"
      "[[medium]]\nsigma_a_per_mm = 0.1\nsigma_s_per_mm = 10\ng = 0.9\n"
      "[[medium]]\nsigma_a_per_mm = 0.3\nsigma_s_per_mm = 2\n"
      "[pattern]\ntype = \"veins\"\nextent_mm = [10, 10]\nvoxel_mm = 1\n",
      "p.toml");
  const Volume volume = MakeVolume(phantom, 0);
  ASSERT_EQ(volume.media.size(), 64u);
  for (std::size_t k = 0; k < 64; ++k) {
    const double f = static_cast<double>(k) / 63;
    const monte_carlo::Optics& m = volume.media[k];
    EXPECT_NEAR(m.sigma_a_per_mm, 0.1 + 0.2 * f, 1e-12);
    EXPECT_NEAR(m.sigma_s_per_mm, 10 - 8 * f, 1e-12);
    EXPECT_NEAR(m.sigma_s_per_mm * (1 - m.g), 1 + f, 1e-12);
  }
}

struct BadKind {
  std::string text;
  const char* message;
};

const std::string kTwo =
    "medium = [\"marble\", \"skin1\"]\n[slab]\nthickness_mm = 5\neta = 1.5\n";

TEST(PhantomKinds, BadFilesAreRefusedWithFileAndLine) {
  const std::string layered = "medium = \"marble\"\n[slab]\n";
  for (const BadKind& bad : {
           BadKind{"medium = \"granite\"\n[slab]\nthickness_mm = 1\n",
                   "p.toml:1: medium: 'granite' is not known; known are: apple"},
           BadKind{
               "channels = [\"638nm\"]\nmedium = \"marble\"\n[slab]\nthickness_mm = "
               "1\n",
               "p.toml:2: medium: 'marble' was measured in R, G and B"},
           BadKind{
               "[slab]\nthickness_mm = 1\neta = 1.5\n[[medium]]\nsigma_a_per_mm = 1\n"
               "sigma_s_per_mm = 1\nreduced_sigma_s_per_mm = 1\n",
               "p.toml:7: medium[0].reduced_sigma_s_per_mm: given beside"},
           BadKind{layered + "[[layer]]\nmedium = \"marble\"\n",
                   "missing layer[0].thickness_mm"},
           BadKind{layered + "[[layer]]\nmedium = \"marbel\"\nthickness_mm = 1\n",
                   "p.toml:4: layer[0].medium: 'marbel' is not the name"},
           BadKind{layered + "thickness_mm = 3\n[[layer]]\nmedium = \"marble\"\n"
                             "thickness_mm = 1\n",
                   "layers are 1 mm thick together, but slab.thickness_mm is 3"},
           BadKind{layered + "thickness_mm = 1\n[[layer]]\nmedium = \"marble\"\n"
                             "thickness_mm = 1\n[[layer]]\nmedium = \"marble\"\n",
                   "thickness_mm: 0 mm for the layer below 1 mm"},
           BadKind{layered + "[[layer]]\nmedium = \"marble\"\nthickness_mm = inf\n"
                             "[[layer]]\nmedium = \"marble\"\nthickness_mm = 1\n",
                   "only the last one's may be infinite"},
           BadKind{layered +
                       "[[layer]]\nmedium = \"marble\"\nthickness_mm = 1\n[pattern]\n"
                       "type = \"stripes\"\ncell_mm = 1\n",
                   "pattern: given for a slab of layers"},
           BadKind{"medium = \"marble\"\n[slab]\nthickness_mm = 5\n[pattern]\n"
                   "type = \"layers\"\n",
                   "p.toml:5: pattern.type: 'layers' given, but there is no [[layer]]"},
           BadKind{"[slab]\nthickness_mm = 0.1\n[skin]\n", "leaves no dermis"},
           BadKind{"[slab]\n[skin]\nmelanin_fraction = 2\n",
                   "p.toml:3: skin.melanin_fraction: 2 is outside"},
           BadKind{"[slab]\n[skin]\nwavelengths_nm = [200, 500, 600]\n",
                   "p.toml:3: skin.wavelengths_nm: 200 is outside"},
           BadKind{"channels = [\"x\"]\n[slab]\n[skin]\n",
                   "skin.wavelengths_nm: missing"},
           BadKind{kTwo + "[pattern]\ntype = \"veins\"\n",
                   "pattern.extent_mm: missing"},
           BadKind{kTwo + "[pattern]\ntype = \"veins\"\nextent_mm = [1000, 1000]\n"
                          "voxel_mm = 0.01\n",
                   "p.toml:8: pattern.voxel_mm: 100000 × 100000 × 500 voxels are more"},
           BadKind{kTwo + "[pattern]\ntype = \"veins\"\nextent_mm = [1e6, 1]\n"
                          "voxel_mm = 1e-4\n",
                   "pattern.voxel_mm: 0.0001 mm make 1e+10 voxels"},
           BadKind{
               kTwo + "[pattern]\ntype = \"veins\"\nextent_mm = [5, 5]\nwarp = -1\n",
               "p.toml:8: pattern.warp: -1 is outside"},
           BadKind{"medium = \"marble\"\n[slab]\nthickness_mm = 5\n[pattern]\n"
                   "type = \"onyx\"\n",
                   "p.toml:5: pattern.type: 1 media given, but the pattern 'onyx'"},
           BadKind{
               "medium = [\"marble\", \"skin1\"]\n[slab]\nthickness_mm = inf\neta = "
               "1.5\n"
               "[pattern]\ntype = \"onyx\"\nextent_mm = [5, 5]\n",
               "pattern.depth_mm: missing"},
           BadKind{kTwo + "[pattern]\ntype = \"inclusions\"\nextent_mm = [5, 5]\n",
                   "pattern.inclusion: missing"},
           BadKind{kTwo + "[pattern]\ntype = \"inclusions\"\nextent_mm = [5, 5]\n"
                          "[[pattern.inclusion]]\nmedium = \"gold\"\n",
                   "'gold' is not one of the phantom's media: marble, skin1"},
           BadKind{kTwo + "[pattern]\ntype = \"inclusions\"\nextent_mm = [5, 5]\n"
                          "[[pattern.strewn]]\nmedium = \"skin1\"\ncount = 5\n"
                          "radius_mm = [3, 2]\n",
                   "radius_mm: expected one number, or [smallest, largest]"},
       }) {
    EXPECT_THAT([&] { ParsePhantom(bad.text, "p.toml"); },
                ThrowsMessage<Error>(HasSubstr(bad.message)))
        << bad.text;
  }
}

class VoxelFiles : public ::testing::Test {
 protected:
  void Expect(const std::string& keys, const char* message) {
    EXPECT_THAT(
        [&] {
          ParsePhantom(kTwo + "[pattern]\ntype = \"voxels\"\nvoxel_mm = 1\n" + keys,
                       (folder_ / "p.toml").string());
        },
        ThrowsMessage<Error>(HasSubstr(message)))
        << keys;
  }
  nacre::testing::TempFolder folder_;
};

TEST_F(VoxelFiles, BadOnesAreRefused) {
  WriteFile(folder_ / "short.raw", std::string(7, '\0'));
  WriteFile(folder_ / "label.raw", std::string(8, '\2'));
  WriteFile(folder_ / "nan.raw", std::string(4, '\xFF'));
  const std::string count = "count = [2, 2, 2]\n";
  Expect("file = \"none.raw\"\n" + count, "none.raw");
  Expect("file = \"short.raw\"\n", "missing pattern.count");
  Expect("file = \"short.raw\"\n" + count, "holds 7 bytes, but 2 × 2 × 2 numbers");
  Expect("file = \"label.raw\"\n" + count + "data = \"int8\"\n",
         "pattern.data: 'int8' is not known");
  Expect("file = \"label.raw\"\n" + count, "holds the label 2, but there are 2 media");
  Expect("file = \"label.raw\"\n" + count + "meaning = \"density\"\n",
         "pattern.meaning: 'density' is not known");
  Expect("file = \"label.raw\"\ncount = [1e6, 1e6, 1]\n",
         "pattern.count: 1000000 × 1000000 × 1 voxels are more than");
  Expect("file = \"nan.raw\"\ncount = [1, 1, 1]\ndata = \"float32\"\n", "number 0 is");
  WriteFile(folder_ / "text.npy", "hello, this is not an array");
  Expect("file = \"text.npy\"\n", "isn't a NumPy file");
  const auto npy = [](const std::string& header, const std::string& data) {
    return "\x93NUMPY\x01" + std::string(1, '\0') +
           std::string(1, static_cast<char>(header.size())) + std::string(1, '\0') +
           header + data;
  };
  WriteFile(folder_ / "double.npy",
            npy("{'descr': '<f8', 'fortran_order': False, 'shape': (1, 1), }",
                std::string(8, '\0')));
  Expect("file = \"double.npy\"\n", "NumPy array of type '<f8'");
  WriteFile(folder_ / "shape.npy",
            npy("{'descr': '|u1', 'fortran_order': False, 'shape': (1, -1), }", "a"));
  Expect("file = \"shape.npy\"\n", "its NumPy shape can't be read");
  WriteFile(folder_ / "cut.npy",
            npy("{'descr': '|u1', 'fortran_order': False, 'shape': (3, 1), }", "a"));
  Expect("file = \"cut.npy\"\n", "holds");
  WriteFile(folder_ / "head.npy", std::string("\x93NUMPY\x01\0\xFF\xFF{", 11));
  Expect("file = \"head.npy\"\n", "ends in its NumPy header");
}

}  // namespace
}  // namespace nacre::rigs
