#include "rigs/transport/radial_table.h"

#include "core/error.h"
#include "core/parallel.h"
#include "core/simd_clones.h"
#include "rigs/internal/fast_exp2.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace nacre::rigs {
namespace {

// 2^kNodeBits nodes for each doubling of 1 + r²/r₀².
constexpr int kNodeBits = 5;
constexpr int kShift = 23 - kNodeBits;
constexpr std::uint32_t kBitsOfOne = 0x3F800000U;
constexpr std::uint32_t kMask = (1U << kShift) - 1U;
constexpr float kPerStep = 1.0F / static_cast<float>(1U << kShift);

struct Lookup {
  const float* log2;
  int nodes;
  int rows;
  float inverse_inner2;
  float offset;
  float offset_root;
  float row_scale;
  float fraction_base;  // f' = base + sign · f
  float fraction_sign;
};

// NOLINTNEXTLINE(readability-function-size): plain arrays are what becomes vectors
NACRE_SIMD_CLONES void AddValues(const Lookup& table,
                                 const float* __restrict dx,
                                 const float* __restrict dy,
                                 const float* __restrict fraction,
                                 float scale,
                                 std::size_t count,
                                 float* __restrict out) {
  const float* const log2 = table.log2;
  const int nodes = table.nodes;
  const int last_node = nodes - 2;
  const int last_row = table.rows - 2;
  const float inverse_inner2 = table.inverse_inner2;
  const float offset = table.offset;
  const float offset_root = table.offset_root;
  const float row_scale = table.row_scale;
  const float base = table.fraction_base;
  const float sign = table.fraction_sign;
  for (std::size_t k = 0; k < count; ++k) {
    const float q = 1.0F + (dx[k] * dx[k] + dy[k] * dy[k]) * inverse_inner2;
    const std::uint32_t bits = std::bit_cast<std::uint32_t>(q) - kBitsOfOne;
    const int node_index = static_cast<int>(bits >> kShift);
    const int node = node_index < last_node ? node_index : last_node;
    const float beyond = static_cast<float>(bits & kMask) * kPerStep;
    const float t = node_index <= last_node ? beyond : 1.0F;
    const float w =
        (std::sqrt(offset + base + sign * fraction[k]) - offset_root) * row_scale;
    const int row_index = static_cast<int>(w);
    const int row = row_index < last_row ? row_index : last_row;
    const float s = w - static_cast<float>(row);
    const int at = row * nodes + node;
    const float low = log2[at] + t * (log2[at + 1] - log2[at]);
    const float high = log2[at + nodes] + t * (log2[at + nodes + 1] - log2[at + nodes]);
    out[k] += scale * internal::FastExp2(low + s * (high - low));
  }
}

}  // namespace

RadialTable::RadialTable(const Layout& layout,
                         const std::function<double(double, double)>& value,
                         int thread_count)
    : layout_(layout),
      inverse_inner2_(static_cast<float>(1 / (layout.inner_mm * layout.inner_mm))),
      offset_(static_cast<float>(layout.fraction_offset)),
      offset_root_(std::sqrt(offset_)) {
  Expect(layout.inner_mm > 0 && layout.outer_mm > layout.inner_mm,
         "a table with some extent");
  const int rows = layout.fraction_rows;
  Expect(layout.fraction_offset >= 0 && rows >= 2, "a table with at least two rows");
  row_scale_ =
      static_cast<float>(rows - 1) / (std::sqrt(offset_ + 1.0F) - offset_root_);
  const double ratio = layout.outer_mm / layout.inner_mm;
  const float last = static_cast<float>(1 + ratio * ratio);
  nodes_ =
      static_cast<int>((std::bit_cast<std::uint32_t>(last) - kBitsOfOne) >> kShift) + 2;
  const auto node_count = static_cast<std::size_t>(nodes_);
  log2_.resize(static_cast<std::size_t>(rows) * node_count);
  ParallelFor(rows, thread_count, [&](std::int64_t row) {
    const double fraction = RowFraction(static_cast<int>(row));
    for (std::size_t node = 0; node < node_count; ++node) {
      // Below 2^−126 the sum of all cells of all slices notices nothing.
      const double v = std::max(value(fraction, NodeDistance(node)), 0x1p-126);
      log2_[static_cast<std::size_t>(row) * node_count + node] =
          static_cast<float>(std::log2(v));
    }
  });
}

double RadialTable::NodeDistance(std::size_t node) const {
  const auto bits = kBitsOfOne + (static_cast<std::uint32_t>(node) << kShift);
  const double q = static_cast<double>(std::bit_cast<float>(bits));
  return layout_.inner_mm * std::sqrt(q - 1);
}

double RadialTable::RowFraction(int row) const {
  const double root =
      static_cast<double>(offset_root_) + row / static_cast<double>(row_scale_);
  const double f = std::clamp(root * root - static_cast<double>(offset_), 0.0, 1.0);
  return layout_.fraction_reversed ? 1 - f : f;
}

void RadialTable::Add(PointMm centre,
                      double scale,
                      const PointColumns& points,
                      const float* fraction,
                      float* out) const {
  constexpr std::size_t kPiece = 256;
  float dx[kPiece];
  float dy[kPiece];
  const Lookup table{log2_.data(),
                     nodes_,
                     layout_.fraction_rows,
                     inverse_inner2_,
                     offset_,
                     offset_root_,
                     row_scale_,
                     layout_.fraction_reversed ? 1.0F : 0.0F,
                     layout_.fraction_reversed ? -1.0F : 1.0F};
  const auto x = static_cast<float>(centre.x);
  const auto y = static_cast<float>(centre.y);
  for (std::size_t begin = 0; begin < points.count; begin += kPiece) {
    const std::size_t count = std::min(kPiece, points.count - begin);
    for (std::size_t k = 0; k < count; ++k) {
      dx[k] = points.x_mm[begin + k] - x;
      dy[k] = points.y_mm[begin + k] - y;
    }
    AddValues(
        table, dx, dy, fraction + begin, static_cast<float>(scale), count, out + begin);
  }
}

double RadialTable::Value(double r_mm, double fraction) const {
  const float x = static_cast<float>(r_mm);
  const float y = 0;
  const float f = static_cast<float>(fraction);
  float out = 0;
  Add({0, 0}, 1, {&x, &y, 1}, &f, &out);
  return static_cast<double>(out);
}

double RadialTable::Reach(double loss) const {
  const auto node_count = static_cast<std::size_t>(nodes_);
  double reach = 0;
  for (std::size_t row = 0; row < static_cast<std::size_t>(layout_.fraction_rows);
       ++row) {
    const float* const log2 = &log2_[row * node_count];
    double outside = 0;
    for (std::size_t node = node_count - 1; node > 0; --node) {
      const double outer = NodeDistance(node);
      const double inner = NodeDistance(node - 1);
      const double mean =
          std::exp2(0.5 * static_cast<double>(log2[node] + log2[node - 1]));
      outside += mean * std::numbers::pi * (outer * outer - inner * inner);
      if (outside > loss) {
        reach = std::max(reach, outer);
        break;
      }
    }
  }
  return reach;
}

}  // namespace nacre::rigs
