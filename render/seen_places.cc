#include "render/seen_places.h"

#include "render/bounds.h"

#include <algorithm>
#include <cmath>

namespace nacre::render {
namespace {

// Farther than any cell, and small enough that squares of cells beside it stay exact.
constexpr float kFar = 1e6F;

// One line of the distance transform of sampled functions [Felzenszwalb & Huttenlocher
// 12]: d(p) = min_q (p − q)² + f(q), the lower envelope of parabolas.
class LineTransform {
 public:
  void operator()(float* values, std::ptrdiff_t stride, int count) {
    const auto n = static_cast<std::size_t>(count);
    f_.resize(n);
    vertex_.resize(n);
    border_.resize(n + 1);
    for (std::size_t i = 0; i < n; ++i) {
      f_[i] = values[static_cast<std::ptrdiff_t>(i) * stride];
    }
    std::size_t top = 0;
    vertex_[0] = 0;
    border_[0] = -kFar;
    border_[1] = kFar;
    for (std::size_t q = 1; q < n; ++q) {
      float cut = Cut(q, vertex_[top]);
      while (top > 0 && cut <= border_[top]) {
        --top;
        cut = Cut(q, vertex_[top]);
      }
      ++top;
      vertex_[top] = q;
      border_[top] = cut;
      border_[top + 1] = kFar;
    }
    std::size_t k = 0;
    for (std::size_t p = 0; p < n; ++p) {
      while (border_[k + 1] < static_cast<float>(p)) {
        ++k;
      }
      const float d = static_cast<float>(p) - static_cast<float>(vertex_[k]);
      values[static_cast<std::ptrdiff_t>(p) * stride] = d * d + f_[vertex_[k]];
    }
  }

 private:
  float Cut(std::size_t q, std::size_t v) const {
    const auto a = static_cast<float>(q);
    const auto b = static_cast<float>(v);
    return ((f_[q] + a * a) - (f_[v] + b * b)) / (2 * (a - b));
  }
  std::vector<float> f_;
  std::vector<std::size_t> vertex_;
  std::vector<float> border_;
};

}  // namespace

SeenPlaces::SeenPlaces(const Shape& shape) {
  const Box box = BoundsOf(shape);
  const Vec3 extent = box.high - box.low;
  const float longest = std::max(MaxComponent(extent), 1e-30F);
  low_ = box.low;
  per_unit_ = static_cast<float>(kCells) / longest;
  std::size_t count = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const int cells = 1 + static_cast<int>(extent[axis] * per_unit_);
    size_[static_cast<std::size_t>(axis)] = cells;
    count *= static_cast<std::size_t>(cells);
  }
  seen_ = std::make_unique<std::atomic<std::uint8_t>[]>(count);
}

std::int64_t SeenPlaces::CellOf(Vec3 position) const {
  const Vec3 at = (position - low_) * per_unit_;
  std::int64_t cell = 0;
  for (int axis = 2; axis >= 0; --axis) {
    const int size = size_[static_cast<std::size_t>(axis)];
    const float along = std::clamp(at[axis], 0.0F, static_cast<float>(size - 1));
    cell = cell * size + static_cast<int>(along);
  }
  return cell;
}

Color SeenPlaces::At(const SurfaceHit& hit, const ExitanceQuery& query) const {
  if (query.sight == Sight::kSharp) {
    seen_[static_cast<std::size_t>(CellOf(hit.position))].store(
        1, std::memory_order_relaxed);
  }
  return {};
}

void SeenPlaces::Finish() {
  const std::ptrdiff_t nx = size_[0];
  const std::ptrdiff_t ny = size_[1];
  const std::ptrdiff_t nz = size_[2];
  squared_.resize(static_cast<std::size_t>(nx * ny * nz));
  for (std::size_t i = 0; i < squared_.size(); ++i) {
    const bool seen = seen_[i].load(std::memory_order_relaxed) != 0;
    seen_count_ += seen ? 1 : 0;
    squared_[i] = seen ? 0 : kFar;
  }
  seen_.reset();
  LineTransform transform;
  for (std::ptrdiff_t row = 0; row < ny * nz; ++row) {
    transform(&squared_[static_cast<std::size_t>(row * nx)], 1, size_[0]);
  }
  for (std::ptrdiff_t z = 0; z < nz; ++z) {
    for (std::ptrdiff_t x = 0; x < nx; ++x) {
      transform(&squared_[static_cast<std::size_t>(z * nx * ny + x)], nx, size_[1]);
    }
  }
  for (std::ptrdiff_t column = 0; column < nx * ny; ++column) {
    transform(&squared_[static_cast<std::size_t>(column)], nx * ny, size_[2]);
  }
}

float SeenPlaces::DistanceTo(Vec3 position) const {
  const float squared = squared_[static_cast<std::size_t>(CellOf(position))];
  if (squared >= 0.5F * kFar) {
    return std::numeric_limits<float>::infinity();
  }
  return std::max(0.0F, std::sqrt(squared) - std::numbers::sqrt3_v<float>) / per_unit_;
}

}  // namespace nacre::render
