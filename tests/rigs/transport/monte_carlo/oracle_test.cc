#include "core/random.h"
#include "rigs/transport/monte_carlo/scalar_oracle.h"
#include "tests/rigs/transport/monte_carlo/reference_totals.h"
#include "tests/rigs/transport/monte_carlo/support.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace nacre::rigs::monte_carlo {
namespace {

// A random volume and beam of every kind there is.
class RandomCase {
 public:
  explicit RandomCase(std::uint64_t index) : random_(2024, index) {
    for (int k = 0; k < 3; ++k) {
      volume.media.push_back(
          {Between(0.005, 0.3), Between(0.3, 4), Between(-0.4, 0.9)});
    }
    volume.layers = {{Between(0.5, 4), Between(1, 1.6), 1}};
    volume.bottom = static_cast<Bottom>(Below(4));
    switch (index % 5) {
      case 0:
        break;
      case 1:
        volume.pattern = {
            Below(2) == 0 ? PatternType::kChessboard : PatternType::kStripes,
            Between(0.2, 1)};
        break;
      case 2:
        AddVoxels();
        break;
      case 3:
        volume.layers.push_back({Between(0.1, 1), Between(1, 1.6), 0});
        volume.layers.push_back({Below(2) == 0 ? kInf : 2.0, Between(1, 1.6), 2});
        break;
      default:
        volume.box = Box{Between(0.5, 2), Between(0.5, 2)};
        if (Below(2) == 0) {
          AddVoxels();
        }
        break;
    }
    source.centre = {Between(-0.3, 0.3), Between(-0.3, 0.3)};
    source.shape = static_cast<BeamShape>(Below(4));
    source.width_mm = Between(0, 0.8);
    source.angle_rad = Below(2) == 0 ? 0 : Between(-1.3, 1.3);
    source.diffuse = Below(4) == 0;
  }

  Volume volume;
  Source source;

 private:
  double Between(double low, double high) {
    return low + (high - low) * random_.Uniform();
  }
  int Below(int count) { return static_cast<int>(count * random_.Uniform()); }
  void AddVoxels() {
    VoxelGrid grid{.count = {4, 3, 5},
                   .size_mm = {Between(0.1, 0.5), Between(0.1, 0.5), Between(0.1, 0.5)},
                   .left_mm = -0.7,
                   .lower_mm = -0.5,
                   .medium = {}};
    for (int k = 0; k < 60; ++k) {
      grid.medium.push_back(static_cast<std::uint16_t>(Below(3)));
    }
    volume.voxels = grid;
  }

  RandomStream random_;
};

struct Agreement {
  double chi2 = 0;
  int count = 0;

  void Add(const Estimate& a, const Estimate& b) {
    if (a.mean == 0 && b.mean == 0) {
      return;
    }
    const double z = Deviation(a, b);
    EXPECT_LT(std::abs(z), 4.5);
    chi2 += z * z;
    ++count;
  }
};

// Cells with few photons aren't Gaussian; they are left out.
void AddCells(const std::vector<Estimate>& a,
              const std::vector<Estimate>& b,
              Agreement& agreement) {
  for (std::size_t k = 0; k < a.size(); ++k) {
    if (a[k].mean > 5 * a[k].se && b[k].mean > 5 * b[k].se) {
      agreement.Add(a[k], b[k]);
    }
  }
}

TEST(Oracle, AgreesWithPacketsOnTwentyRandomPhantoms) {
  Agreement agreement;
  for (std::uint64_t index = 0; index < 20; ++index) {
    SCOPED_TRACE(index);
    const RandomCase c(index);
    const TallyRequest request{.window_core = 9,
                               .window_pitch_mm = 0.2,
                               .cosine_count = 8,
                               .depth_count = 10,
                               .depth_step_mm = 0.3};
    const Result fast = Simulate(c.volume, c.source, request, Photons(150'000));
    const Result slow = SimulateScalar(c.volume, c.source, request, Photons(12'000));
    agreement.Add(fast.reflected, slow.reflected);
    agreement.Add(fast.transmitted, slow.transmitted);
    agreement.Add(fast.absorbed, slow.absorbed);
    agreement.Add(fast.backing, slow.backing);
    agreement.Add(fast.sides, slow.sides);
    agreement.Add(fast.unscattered_transmitted, slow.unscattered_transmitted);
    AddCells(fast.absorbed_in_medium, slow.absorbed_in_medium, agreement);
    AddCells(fast.window_per_mm2, slow.window_per_mm2, agreement);
    AddCells(fast.reflected_in_cosine, slow.reflected_in_cosine, agreement);
    AddCells(fast.transmitted_in_cosine, slow.transmitted_in_cosine, agreement);
    AddCells(fast.absorbed_in_depth, slow.absorbed_in_depth, agreement);
  }
  EXPECT_GT(agreement.count, 300);
  EXPECT_LT(agreement.chi2 / agreement.count, 1.2);
  EXPECT_GT(agreement.chi2 / agreement.count, 0.8);
}

TEST(Oracle, ItsMethodsAgreeAndImplicitCaptureKeepsTheBooks) {
  const Volume volume = Chessboard();
  const Source source{.centre = {0.75, 0.75}};
  const Estimate expected{0.56396, 0.0003};
  for (const Capture capture : {Capture::kAnalog, Capture::kImplicit}) {
    for (const Tracking tracking : {Tracking::kExact, Tracking::kWoodcock}) {
      const Result r =
          SimulateScalar(volume, source, {}, Photons(20'000), {capture, tracking, 0.1});
      EXPECT_LT(std::abs(Deviation(r.reflected, expected)), 3.5);
      EXPECT_NEAR(r.reflected.mean + r.transmitted.mean + r.absorbed.mean,
                  1,
                  capture == Capture::kAnalog ? 1e-12 : 0.03);
    }
  }
}

}  // namespace
}  // namespace nacre::rigs::monte_carlo
