#include "bench/factor/soft_chessboard.h"

#include "core/parallel.h"

#include <cmath>
#include <cstdint>
#include <string>

namespace nacre::bench {
namespace {

// σ' of two media in a chessboard with soft borders and fine texture, 1/mm.
double Attenuation(double x, double y) {
  const double board = std::tanh(4 * std::sin(x) * std::sin(y));
  return 1.2 + 0.6 * board + 0.15 * std::sin(3.1 * x + 2 * std::sin(1.7 * y)) +
         0.08 * std::sin(17 * x) * std::cos(13 * y + x);
}

}  // namespace

reconstruct::RdDataset MakeSoftChessboard(int points_x,
                                          int points_y,
                                          int core,
                                          int channels) {
  reconstruct::RdDataset data;
  data.header = {points_x, points_y, core, 0.2, 1.4, {}, {}};
  for (int c = 0; c < channels; ++c) {
    data.header.channels.push_back(channels == 1 ? "Y" : std::string(1, "RGBA"[c % 4]));
  }
  const auto size = static_cast<std::size_t>(data.header.SliceSize());
  const auto rows = static_cast<std::size_t>(data.header.PointCount());
  data.rd.resize(rows * size);
  data.valid.assign(rows * size, 1);
  const double step = 8 * 3.14159265 / points_x;
  ParallelFor(static_cast<std::int64_t>(rows), 0, [&](std::int64_t row) {
    const double x = static_cast<double>(row % points_x) * step;
    const double y = static_cast<double>(row / points_x) * step;
    std::uint64_t state = static_cast<std::uint64_t>(row) * 0x9E3779B97F4A7C15U + 1;
    float* out = &data.rd[static_cast<std::size_t>(row) * size];
    for (int c = 0; c < channels; ++c) {
      for (int v = 0; v < core; ++v) {
        for (int u = 0; u < core; ++u) {
          const double du = u - (core - 1) / 2;
          const double dv = v - (core - 1) / 2;
          const double sigma =
              (Attenuation(x, y) + Attenuation(x + du * step, y + dv * step) +
               Attenuation(x + 0.5 * du * step, y + 0.5 * dv * step)) /
                  3 +
              0.4 * c;
          const double r = 0.2 * std::hypot(du, dv, 2.0);
          state = state * 6364136223846793005U + 1442695040888963407U;
          const double noise = static_cast<double>(state >> 11) * 0x1p-53 - 0.5;
          *out++ =
              static_cast<float>(std::exp(-sigma * r) / (r * r * r) + 1e-5 * noise);
        }
      }
    }
  });
  return data;
}

}  // namespace nacre::bench
