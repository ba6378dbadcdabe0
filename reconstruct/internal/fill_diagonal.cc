#include "reconstruct/internal/fill_diagonal.h"

#include <cmath>

namespace nacre::reconstruct::internal {
namespace {

// A straight line through (r, ln R_d).
struct Line {
  double count = 0, r = 0, y = 0, rr = 0, ry = 0;

  void Add(double at, double value) {
    count += 1;
    r += at;
    y += value;
    rr += at * at;
    ry += at * value;
  }
  double At(double at) const {
    const double determinant = count * rr - r * r;
    const double slope = determinant > 0 ? (count * ry - r * y) / determinant : 0;
    return (y - slope * r) / count + slope * at;
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
        slice.valid[at] = 0;
        slice.sigma[at] = 0;
        slice.rd[at] = positive && line.count > 2
                           ? static_cast<float>(std::exp(line.At(r)))
                           : 0.0F;
      }
    });
  }
}

}  // namespace nacre::reconstruct::internal
