#include "render/subsurface/lit_point_cloud.h"

#include "core/error.h"
#include "core/parallel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <span>
#include <tuple>

namespace nacre::render {
namespace {

constexpr int kBitsPerAxis = 20;

/// Where the lattice of voxels starts, as a fraction of a voxel: surfaces like to lie
/// on round coordinates, and a boundary there would cut them into two layers of
/// patches.
constexpr float kLatticeShift = 0.3819660F;

/// Voxel and side in one number: groups are what has the same.
struct KeyedPoint {
  std::uint64_t key;
  const LitPoint* point;
  int part = 0;
  std::uint64_t Voxel() const { return key >> 3; }
};

std::uint64_t SpreadBits(std::uint64_t v) {
  v = (v | (v << 32)) & 0x001F00000000FFFFu;
  v = (v | (v << 16)) & 0x001F0000FF0000FFu;
  v = (v | (v << 8)) & 0x100F00F00F00F00Fu;
  v = (v | (v << 4)) & 0x10C30C30C30C30C3u;
  return (v | (v << 2)) & 0x1249249249249249u;
}

std::uint64_t DominantSide(Vec3 n) {
  const float ax = std::abs(n.x);
  const float ay = std::abs(n.y);
  const float az = std::abs(n.z);
  const int axis = ax >= ay && ax >= az ? 0 : ay >= az ? 1 : 2;
  return static_cast<std::uint64_t>(2 * std::int64_t{axis} + (n[axis] < 0 ? 1 : 0));
}

std::array<std::int64_t, 3> VoxelOf(Vec3 p, float side_mm) {
  const auto along = [&](float x) {
    return static_cast<std::int64_t>(std::floor(x / side_mm + kLatticeShift));
  };
  return {along(p.x), along(p.y), along(p.z)};
}

bool IsFinite(const LitPoint& lit) {
  const Vec3 sum = lit.point.position_mm + lit.point.normal + lit.flux_density;
  return std::isfinite(sum.x + sum.y + sum.z + lit.area_mm2);
}

std::vector<KeyedPoint> SortIntoVoxels(const std::vector<LitPoint>& lit,
                                       float side_mm,
                                       const PartFunction& part_of) {
  std::vector<KeyedPoint> keyed;
  keyed.reserve(lit.size());
  std::array<std::int64_t, 3> low;
  std::array<std::int64_t, 3> high;
  low.fill(std::numeric_limits<std::int64_t>::max());
  high.fill(std::numeric_limits<std::int64_t>::min());
  for (const LitPoint& point : lit) {
    if (!IsFinite(point)) {
      throw UsageError(
          "a lit point of a translucent object isn't finite: check the "
          "object's vertices and the lights");
    }
    if (MaxComponent(point.flux_density) <= 0 || point.area_mm2 <= 0) {
      continue;
    }
    const auto voxel = VoxelOf(point.point.position_mm, side_mm);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], voxel[axis]);
      high[axis] = std::max(high[axis], voxel[axis]);
    }
    keyed.push_back(
        {DominantSide(point.point.normal), &point, part_of ? part_of(point.point) : 0});
  }
  for (std::size_t axis = 0; axis < 3 && !keyed.empty(); ++axis) {
    if (high[axis] - low[axis] >= (std::int64_t{1} << kBitsPerAxis)) {
      throw UsageError(fmt::format(
          "a translucent object reaches over {} patches of {:g} mm; at most "
          "{} are possible: is its scale in millimetres?",
          high[axis] - low[axis] + 1,
          side_mm,
          1 << kBitsPerAxis));
    }
  }
  for (KeyedPoint& k : keyed) {
    const auto voxel = VoxelOf(k.point->point.position_mm, side_mm);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      k.key |= SpreadBits(static_cast<std::uint64_t>(voxel[axis] - low[axis]))
               << (axis + 3);
    }
  }
  std::sort(keyed.begin(), keyed.end(), [](const KeyedPoint& a, const KeyedPoint& b) {
    return a.key != b.key ? a.key < b.key : a.part < b.part;
  });
  return keyed;
}

/// Axes of the covariance ((a, b), (b, c)) in the frame (s, t), scaled by the standard
/// deviations.
void SetAxes(Patch& patch, const Frame& frame, double a, double b, double c) {
  const double mean = 0.5 * (a + c);
  const double split = std::hypot(0.5 * (a - c), b);
  const double angle = 0.5 * std::atan2(2 * b, a - c);
  const auto u = static_cast<float>(std::cos(angle));
  const auto v = static_cast<float>(std::sin(angle));
  const auto longer = static_cast<float>(std::sqrt(std::max(0.0, mean + split)));
  const auto shorter = static_cast<float>(std::sqrt(std::max(0.0, mean - split)));
  patch.axis_a_mm = frame.ToWorld({u * longer, v * longer, 0});
  patch.axis_b_mm = frame.ToWorld({-v * shorter, u * shorter, 0});
}

/// Where a point would be whose texture coordinates went on evenly to `position_mm`.
Vec2 UvAt(const SurfacePoint& from, Vec3 position_mm) {
  const Vec3 stretch = from.stretch_mm;
  if (!(std::abs(stretch.x) > 0 && stretch.z > 0)) {
    return from.uv;
  }
  const Vec3 d = position_mm - from.position_mm;
  const float dv = Dot(d, from.tangent_v) / stretch.z;
  const float du = (Dot(d, from.tangent_u) - dv * stretch.y) / stretch.x;
  return {from.uv.x + du, from.uv.y + dv};
}

const SurfacePoint& NearestMember(std::span<const KeyedPoint> members, Vec3 position) {
  const auto distance2 = [&](const KeyedPoint& k) {
    const Vec3 d = k.point->point.position_mm - position;
    return Dot(d, d);
  };
  return std::min_element(members.begin(),
                          members.end(),
                          [&](const KeyedPoint& a, const KeyedPoint& b) {
                            return distance2(a) < distance2(b);
                          })
      ->point->point;
}

Patch MergePoints(std::span<const KeyedPoint> members) {
  double area = 0;
  double weight_sum = 0;
  std::array<double, 3> flux{};
  std::array<double, 3> centre{};
  std::array<double, 3> normal{};
  for (const KeyedPoint& k : members) {
    const LitPoint& lit = *k.point;
    const auto member_area = static_cast<double>(lit.area_mm2);
    const Color e = lit.flux_density;
    const double weight = member_area * static_cast<double>(e.x + e.y + e.z);
    area += member_area;
    weight_sum += weight;
    for (int c = 0; c < 3; ++c) {
      const auto i = static_cast<std::size_t>(c);
      flux[i] += member_area * static_cast<double>(e[c]);
      centre[i] += weight * static_cast<double>(lit.point.position_mm[c]);
      normal[i] += member_area * static_cast<double>(lit.point.normal[c]);
    }
  }
  const auto to_vec = [](const std::array<double, 3>& v, double scale) {
    return Vec3{static_cast<float>(v[0] * scale),
                static_cast<float>(v[1] * scale),
                static_cast<float>(v[2] * scale)};
  };
  const Vec3 position = to_vec(centre, 1 / weight_sum);
  Patch patch;
  patch.point = NearestMember(members, position);
  patch.point.uv = UvAt(patch.point, position);
  patch.point.position_mm = position;
  patch.flux_w = to_vec(flux, 1);
  patch.area_mm2 = static_cast<float>(area);
  patch.voxel = members.front().Voxel();
  if (std::hypot(normal[0], normal[1], normal[2]) > 1e-3 * area) {
    patch.point.normal = Normalized(to_vec(normal, 1));
  }

  // Each member stands for a small square of its own, of variance area / 12 a side.
  const Frame frame(patch.point.normal);
  double a = 0;
  double b = 0;
  double c = 0;
  for (const KeyedPoint& k : members) {
    const LitPoint& lit = *k.point;
    const double weight = static_cast<double>(lit.area_mm2) *
                          static_cast<double>(lit.flux_density.x + lit.flux_density.y +
                                              lit.flux_density.z) /
                          weight_sum;
    const Vec3 d = frame.ToLocal(lit.point.position_mm - position);
    const double own = static_cast<double>(lit.area_mm2) / 12;
    a += weight * (static_cast<double>(d.x * d.x) + own);
    b += weight * static_cast<double>(d.x * d.y);
    c += weight * (static_cast<double>(d.y * d.y) + own);
  }
  SetAxes(patch, frame, a, b, c);
  return patch;
}

/// The patch of a group, whose members are brought into an order of their own, whatever
/// that of the points was.
Patch PatchOf(std::span<KeyedPoint> members) {
  const auto order = [](const KeyedPoint& k) {
    const Vec3 p = k.point->point.position_mm;
    const Color e = k.point->flux_density;
    return std::tuple(p.x, p.y, p.z, k.point->area_mm2, e.x, e.y, e.z);
  };
  std::sort(
      members.begin(), members.end(), [&](const KeyedPoint& a, const KeyedPoint& b) {
        return order(a) < order(b);
      });
  return MergePoints(members);
}

}  // namespace

std::vector<Patch> GatherPatches(const std::vector<LitPoint>& lit,
                                 float side_mm,
                                 const PartFunction& part_of,
                                 int thread_count) {
  Expect(side_mm > 0, "patches have a positive side");
  std::vector<KeyedPoint> keyed = SortIntoVoxels(lit, side_mm, part_of);
  std::vector<std::size_t> first;
  for (std::size_t i = 0; i < keyed.size(); ++i) {
    if (i == 0 || keyed[i].key != keyed[i - 1].key ||
        keyed[i].part != keyed[i - 1].part) {
      first.push_back(i);
    }
  }
  std::vector<Patch> patches(first.size());
  first.push_back(keyed.size());
  constexpr std::int64_t kBlock = 1024;
  ParallelForBlocks(
      std::ssize(patches),
      kBlock,
      thread_count,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t i = begin; i < end; ++i) {
          const auto p = static_cast<std::size_t>(i);
          patches[p] = PatchOf({keyed.data() + first[p], keyed.data() + first[p + 1]});
        }
      });
  return patches;
}

}  // namespace nacre::render
