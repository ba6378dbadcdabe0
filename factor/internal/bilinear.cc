#include "factor/internal/bilinear.h"

#include <algorithm>
#include <vector>

namespace nacre::factor::internal {
namespace {

// The values of all maps at a grid point, or at the nearest point there is.
void MapsAt(const Material& m, GridIndex point, float* f) {
  const int x = std::clamp(point.x + m.margin, 0, m.MapWidth() - 1);
  const int y = std::clamp(point.y + m.margin, 0, m.MapHeight() - 1);
  const std::int64_t at = std::int64_t{y} * m.MapWidth() + x;
  for (int term = 0; term < m.terms; ++term) {
    f[term] = m.f[static_cast<std::size_t>(term * m.MapSize() + at)];
  }
}

// Σ_jk f_j h_jk(d) g_k, the kernels of j > k being those of (k, j) at −d.
double Pair(
    const Material& m, int channel, std::int64_t cell, const float* f, const float* g) {
  const std::int64_t mirrored = m.WindowSize() - 1 - cell;
  const float* kernel = m.Kernel(channel, 0, 0);
  double sum = 0;
  for (int j = 0; j < m.terms; ++j) {
    sum += static_cast<double>(kernel[cell]) * static_cast<double>(f[j]) *
           static_cast<double>(g[j]);
    kernel += m.WindowSize();
    for (int k = j + 1; k < m.terms; ++k) {
      sum += static_cast<double>(kernel[cell]) * static_cast<double>(f[j]) *
                 static_cast<double>(g[k]) +
             static_cast<double>(kernel[mirrored]) * static_cast<double>(f[k]) *
                 static_cast<double>(g[j]);
      kernel += m.WindowSize();
    }
  }
  return sum;
}

float Evaluate(const Material& m,
               int channel,
               GridIndex point,
               GridIndex cell,
               const float* f,
               float* g) {
  const int radius = (m.core - 1) / 2;
  MapsAt(m, {point.x + cell.x - radius, point.y + cell.y - radius}, g);
  const std::int64_t index = std::int64_t{cell.y} * m.core + cell.x;
  const std::int64_t mirrored = m.WindowSize() - 1 - index;
  const double sum = index <= mirrored ? Pair(m, channel, index, f, g)
                                       : Pair(m, channel, mirrored, g, f);
  return static_cast<float>(std::max(0.0, sum));
}

}  // namespace

float BilinearCell(const Material& m, int channel, GridIndex point, GridIndex cell) {
  std::vector<float> maps(2 * static_cast<std::size_t>(m.terms));
  MapsAt(m, point, maps.data());
  return Evaluate(m, channel, point, cell, maps.data(), maps.data() + m.terms);
}

void BilinearWindow(const Material& m, int channel, GridIndex point, float* window) {
  std::vector<float> maps(2 * static_cast<std::size_t>(m.terms));
  MapsAt(m, point, maps.data());
  for (int v = 0; v < m.core; ++v) {
    for (int u = 0; u < m.core; ++u) {
      window[v * m.core + u] =
          Evaluate(m, channel, point, {u, v}, maps.data(), maps.data() + m.terms);
    }
  }
}

}  // namespace nacre::factor::internal
