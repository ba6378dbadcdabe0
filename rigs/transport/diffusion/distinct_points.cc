#include "rigs/transport/diffusion/distinct_points.h"

#include "core/error.h"

#include <array>
#include <cmath>
#include <map>
#include <utility>

namespace nacre::rigs::diffusion {
namespace {

constexpr double kSame = 1e-6;  // of a cell

// Where a point lies in its pattern: the medium of its cell and its distances from the
// cell's borders, at most 1/2 each, in cells; and which symmetry takes the canonical
// point's window to this one's.
struct Place {
  std::array<long, 3> key{};
  WindowSymmetry from_canonical;
};

// Along an axis: which cell, how far from its nearer border, and whether that border is
// the upper one.
struct Along {
  long cell = 0;
  double distance = 0;
  bool mirrored = false;
};

Along Locate(double position_mm, double cell_mm) {
  Along along;
  double u = position_mm / cell_mm;
  // A point that is on a border but for rounding is on it.
  if (std::abs(u - std::round(u)) < kSame) {
    u = std::round(u);
  }
  const double cell = std::floor(u);
  along.cell = std::lround(cell);
  const double within = u - cell;
  along.mirrored = within > 0.5;
  along.distance = along.mirrored ? 1 - within : within;
  return along;
}

long KeyOf(double distance) {
  return std::lround(distance / kSame);
}

bool IsOdd(long cell) {
  return cell % 2 != 0;
}

Place ChessboardPlace(PointMm point, double cell_mm) {
  const Along x = Locate(point.x, cell_mm);
  const Along y = Locate(point.y, cell_mm);
  bool second = IsOdd(x.cell) != IsOdd(y.cell);
  Place place;
  place.from_canonical.mirror_x = x.mirrored;
  place.from_canonical.mirror_y = y.mirrored;
  long kx = KeyOf(x.distance);
  long ky = KeyOf(y.distance);
  // On a border, both cells may claim the point; mirrored, the one's view is the
  // other's. Take the first medium's.
  if (kx == 0 && second) {
    second = false;
    place.from_canonical.mirror_x = !place.from_canonical.mirror_x;
  } else if (ky == 0 && second) {
    second = false;
    place.from_canonical.mirror_y = !place.from_canonical.mirror_y;
  }
  if (kx > ky) {
    std::swap(kx, ky);
    place.from_canonical.transpose = true;
  }
  place.key = {second ? 1 : 0, kx, ky};
  return place;
}

Place StripePlace(PointMm point, double cell_mm) {
  const Along x = Locate(point.x, cell_mm);
  bool second = IsOdd(x.cell);
  Place place;
  place.from_canonical.mirror_x = x.mirrored;
  const long kx = KeyOf(x.distance);
  if (kx == 0 && second) {
    second = false;
    place.from_canonical.mirror_x = !place.from_canonical.mirror_x;
  }
  place.key = {second ? 1 : 0, kx, 0};
  return place;
}

Place PlaceOf(const Pattern& pattern, PointMm point, long index) {
  switch (pattern.type) {
    case PatternType::kHomogeneous:
      return {};
    case PatternType::kChessboard:
      return ChessboardPlace(point, pattern.cell_mm);
    case PatternType::kStripes:
      return StripePlace(point, pattern.cell_mm);
    case PatternType::kMixture:
      return {.key = {index, 0, 0}, .from_canonical = {}};  // no symmetry is known
  }
  throw LogicError("a pattern of no type");
}

// The symmetry that goes to the canonical point and on to another: b after a⁻¹.
WindowSymmetry Compose(const WindowSymmetry& a, const WindowSymmetry& b) {
  // a = mirrors · transpose, so a⁻¹ = transpose · mirrors = exchanged mirrors ·
  // transpose.
  WindowSymmetry result;
  result.transpose = a.transpose != b.transpose;
  bool mx = a.mirror_x;
  bool my = a.mirror_y;
  if (a.transpose != b.transpose) {
    std::swap(mx, my);
  }
  result.mirror_x = mx != b.mirror_x;
  result.mirror_y = my != b.mirror_y;
  return result;
}

}  // namespace

DistinctPoints FindDistinctPoints(const Pattern& pattern,
                                  const acquire::GridDescription& grid) {
  struct First {
    std::uint32_t index;
    WindowSymmetry from_canonical;
  };
  std::map<std::array<long, 3>, First> seen;
  DistinctPoints distinct;
  for (int j = 0; j < grid.points_y; ++j) {
    for (int i = 0; i < grid.points_x; ++i) {
      const PointMm point = grid.Point(i, j);
      const auto index = static_cast<long>(distinct.of.size());
      const Place place = PlaceOf(pattern, point, index);
      const auto [at, is_new] =
          seen.try_emplace(place.key,
                           First{static_cast<std::uint32_t>(distinct.points.size()),
                                 place.from_canonical});
      if (is_new) {
        distinct.points.push_back(point);
      }
      distinct.of.push_back(at->second.index);
      distinct.symmetry.push_back(
          Compose(at->second.from_canonical, place.from_canonical));
    }
  }
  return distinct;
}

Window Transformed(const Window& window, int core, const WindowSymmetry& symmetry) {
  const auto side = static_cast<std::size_t>(core);
  const std::size_t cells = side * side;
  Window result{window.rd, window.sigma};
  for (std::size_t row = 0; row < side; ++row) {
    for (std::size_t col = 0; col < side; ++col) {
      // Undo mirrors, then the exchange. Row 0 is the top, so y grows against rows:
      // x ↔ y takes (col, row) to (side − 1 − row, side − 1 − col).
      std::size_t c = symmetry.mirror_x ? side - 1 - col : col;
      std::size_t r = symmetry.mirror_y ? side - 1 - row : row;
      if (symmetry.transpose) {
        const std::size_t before = c;
        c = side - 1 - r;
        r = side - 1 - before;
      }
      for (std::size_t channel = 0; channel * cells < window.rd.size(); ++channel) {
        const std::size_t to = channel * cells + row * side + col;
        const std::size_t from = channel * cells + r * side + c;
        result.rd[to] = window.rd[from];
        result.sigma[to] = window.sigma[from];
      }
    }
  }
  return result;
}

}  // namespace nacre::rigs::diffusion
