#include "reconstruct/internal/fill_diagonal.h"

#include <algorithm>
#include <cmath>

namespace nacre::reconstruct::internal {
namespace {

// A straight line through (r, ln R_d).
struct Line {
  double count = 0, r = 0, y = 0, rr = 0, ry = 0, yy = 0;

  void Add(double at, double value) {
    count += 1;
    r += at;
    y += value;
    rr += at * at;
    ry += at * value;
    yy += value * value;
  }
  double Determinant() const { return count * rr - r * r; }
  double Slope() const {
    return Determinant() > 0 ? (count * ry - r * y) / Determinant() : 0;
  }
  double At(double at) const { return (y - Slope() * r) / count + Slope() * at; }
  // Of a further value there: the scatter around the line, and what that leaves open of
  // the line itself.
  double Variance(double at) const {
    const double residual = yy - y * y / count - Slope() * (count * ry - r * y) / count;
    const double from_middle = at - r / count;
    const double reach =
        Determinant() > 0 ? count * from_middle * from_middle / Determinant() : 0;
    return std::max(0.0, residual) / std::max(1.0, count - 2) * (1 + 1 / count + reach);
  }
};

}  // namespace

void FillDiagonal(const RdHeader& header, double radius_cells, RdSlice& slice) {
  constexpr double kRing = 2.5;
  const int radius = header.Radius();
  const auto for_each = [&](std::size_t channel, auto&& visit) {
    std::size_t at = channel * static_cast<std::size_t>(header.WindowSize());
    for (int v = -radius; v <= radius; ++v) {
      for (int u = -radius; u <= radius; ++u, ++at) {
        visit(at, std::hypot(u, v));
      }
    }
  };
  for (std::size_t c = 0; c < header.channels.size(); ++c) {
    Line line;
    bool positive = true;
    for_each(c, [&](std::size_t at, double r) {
      if (r > radius_cells && r <= radius_cells + kRing && slice.valid[at] != 0) {
        const auto value = static_cast<double>(slice.rd[at]);
        positive = positive && value > 0;
        line.Add(r, positive ? std::log(value) : 0);
      }
    });
    for_each(c, [&](std::size_t at, double r) {
      if (r <= radius_cells) {
        const bool is_filled = positive && line.count > 2;
        // Inside, ln R_d may rise as steeply as outside or not at all.
        const double rise =
            -std::expm1(line.Slope() * (radius_cells + 0.5 * kRing - r));
        slice.valid[at] = 0;
        slice.rd[at] = is_filled ? static_cast<float>(std::exp(line.At(r))) : 0.0F;
        slice.sigma[at] = is_filled
                              ? slice.rd[at] * static_cast<float>(std::hypot(
                                                   std::sqrt(line.Variance(r)), rise))
                              : 0.0F;
      }
    });
  }
}

}  // namespace nacre::reconstruct::internal
