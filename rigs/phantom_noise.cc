#include "rigs/phantom_noise.h"

#include "core/random.h"

#include <cstddef>
#include <utility>

namespace nacre::rigs {
namespace {

// The quintic with two vanishing derivatives at both ends.
double Fade(double t) {
  return t * t * t * (t * (t * 6 - 15) + 10);
}

double Between(double a, double b, double t) {
  return a + t * (b - a);
}

// Rounds down, without a call of the library's.
std::int32_t Floor(double x) {
  const auto towards_zero = static_cast<std::int32_t>(x);
  return towards_zero - (x < towards_zero ? 1 : 0);
}

// The middles of a cube's edges, four of them twice.
constexpr std::array<std::array<double, 3>, 16> kGradients = {{
    {1, 1, 0},
    {-1, 1, 0},
    {1, -1, 0},
    {-1, -1, 0},
    {1, 0, 1},
    {-1, 0, 1},
    {1, 0, -1},
    {-1, 0, -1},
    {0, 1, 1},
    {0, -1, 1},
    {0, 1, -1},
    {0, -1, -1},
    {1, 1, 0},
    {-1, 1, 0},
    {0, -1, 1},
    {0, -1, -1},
}};

double AlongGradient(std::uint8_t hash, const std::array<double, 3>& p) {
  const std::array<double, 3>& g = kGradients[hash & 15U];
  return g[0] * p[0] + g[1] * p[1] + g[2] * p[2];
}

}  // namespace

GradientNoise::GradientNoise(std::uint64_t seed) {
  constexpr std::size_t kPeriod = 256;
  for (std::size_t k = 0; k < kPeriod; ++k) {
    permutation_[k] = static_cast<std::uint8_t>(k);
  }
  RandomStream random(seed, 0x6E6F697365);
  for (std::size_t k = kPeriod - 1; k > 0; --k) {
    const auto other =
        static_cast<std::size_t>(random.Uniform() * static_cast<double>(k + 1));
    std::swap(permutation_[k], permutation_[other]);
  }
  for (std::size_t k = kPeriod; k < permutation_.size(); ++k) {
    permutation_[k] = permutation_[k - kPeriod];
  }
}

double GradientNoise::At(double x, double y, double z) const {
  const std::array<std::int32_t, 3> cell{Floor(x), Floor(y), Floor(z)};
  const std::array<double, 3> p{x - cell[0], y - cell[1], z - cell[2]};
  const auto i = static_cast<std::size_t>(cell[0] & 255);
  const auto j = static_cast<std::size_t>(cell[1] & 255);
  const auto k = static_cast<std::size_t>(cell[2] & 255);
  const std::array<std::size_t, 2> along_x{permutation_[i] + j,
                                           permutation_[i + 1] + j};
  const double u = Fade(p[0]);
  const auto edge = [&](std::size_t up, std::size_t deep) {
    const double first = AlongGradient(
        permutation_[permutation_[along_x[0] + up] + k + deep],
        {p[0], p[1] - static_cast<double>(up), p[2] - static_cast<double>(deep)});
    const double second = AlongGradient(
        permutation_[permutation_[along_x[1] + up] + k + deep],
        {p[0] - 1, p[1] - static_cast<double>(up), p[2] - static_cast<double>(deep)});
    return Between(first, second, u);
  };
  const double v = Fade(p[1]);
  return Between(Between(edge(0, 0), edge(1, 0), v),
                 Between(edge(0, 1), edge(1, 1), v),
                 Fade(p[2]));
}

double GradientNoise::Turbulent(double x, double y, double z, int octaves) const {
  double sum = 0;
  double scale = 1;
  for (int k = 0; k < octaves; ++k) {
    // Shifted, so that the octaves' zeros don't coincide.
    const double shift = 17.31 * k;
    sum += At(x * scale + shift, y * scale - shift, z * scale + 0.37 * shift) / scale;
    scale *= 2;
  }
  return sum;
}

}  // namespace nacre::rigs
