#include "render/mesh_prepare.h"

#include "core/error.h"
#include "core/json.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <numeric>
#include <unordered_map>

namespace nacre::render {
namespace {

struct PositionHash {
  std::size_t operator()(Vec3 p) const {
    std::uint64_t hash = 0;
    for (const float x : {p.x, p.y, p.z}) {
      const float plain = x == 0 ? 0.0F : x;  // −0 equals 0
      hash = (hash ^ std::bit_cast<std::uint32_t>(plain)) * 0x9E3779B97F4A7C15u;
      hash ^= hash >> 29;
    }
    return hash;
  }
};

/// One vertex a place. Normals and uvs of the file go: both are made anew.
void Weld(TriangleMesh& mesh) {
  std::unordered_map<Vec3, std::uint32_t, PositionHash> index_of;
  std::vector<Vec3> positions;
  std::vector<std::uint32_t> new_index;
  new_index.reserve(mesh.positions.size());
  for (const Vec3 p : mesh.positions) {
    const auto [place, added] =
        index_of.try_emplace(p, static_cast<std::uint32_t>(positions.size()));
    if (added) {
      positions.push_back(p);
    }
    new_index.push_back(place->second);
  }
  mesh.positions = std::move(positions);
  mesh.normals.clear();
  mesh.uvs.clear();
  for (auto& triangle : mesh.triangles) {
    for (std::uint32_t& index : triangle) {
      index = new_index[index];
    }
  }
}

/// Which vertices hang together, by union-find.
class Components {
 public:
  explicit Components(const TriangleMesh& mesh) : parent_(mesh.positions.size()) {
    std::iota(parent_.begin(), parent_.end(), 0u);
    for (const auto& t : mesh.triangles) {
      parent_[Root(t[1])] = Root(t[0]);
      parent_[Root(t[2])] = Root(t[0]);
    }
  }
  std::uint32_t Root(std::uint32_t v) {
    while (parent_[v] != v) {
      parent_[v] = parent_[parent_[v]];
      v = parent_[v];
    }
    return v;
  }

 private:
  std::vector<std::uint32_t> parent_;
};

void SelectComponents(TriangleMesh& mesh,
                      bool largest_only,
                      MeshPrepareSummary& summary) {
  Components components(mesh);
  std::unordered_map<std::uint32_t, double> area;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    area[components.Root(mesh.triangles[i][0])] +=
        static_cast<double>(mesh.TriangleArea(i));
  }
  summary.components = static_cast<std::int64_t>(area.size());
  if (!largest_only) {
    return;
  }
  std::pair<double, std::uint32_t> largest{-1, 0};
  for (const auto& [root, a] : area) {
    largest = std::max(largest, {a, root});
  }
  std::erase_if(mesh.triangles,
                [&](const auto& t) { return components.Root(t[0]) != largest.second; });
  summary.components_dropped = summary.components - 1;
}

/// Removes vertices of no face: they would count in the extent.
void DropUnusedVertices(TriangleMesh& mesh) {
  constexpr auto kUnused = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> new_index(mesh.positions.size(), kUnused);
  std::vector<Vec3> positions;
  for (auto& triangle : mesh.triangles) {
    for (std::uint32_t& index : triangle) {
      if (new_index[index] == kUnused) {
        new_index[index] = static_cast<std::uint32_t>(positions.size());
        positions.push_back(mesh.positions[index]);
      }
      index = new_index[index];
    }
  }
  mesh.positions = std::move(positions);
}

Vec3 Upright(Vec3 p, char up) {
  // Rotations, so that outside stays outside.
  return up == 'z' ? Vec3{p.x, p.z, -p.y} : up == 'x' ? Vec3{-p.y, p.x, p.z} : p;
}

struct Bounds {
  Vec3 low;
  Vec3 high;
  explicit Bounds(const std::vector<Vec3>& points) {
    constexpr float kFarthest = std::numeric_limits<float>::infinity();
    low = {kFarthest, kFarthest, kFarthest};
    high = -low;
    for (const Vec3 p : points) {
      low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
  }
  Vec3 Size() const { return high - low; }
};

void PlaceMesh(TriangleMesh& mesh,
               const MeshPrepareOptions& options,
               MeshPrepareSummary& summary) {
  for (Vec3& p : mesh.positions) {
    p = Upright(p, options.up[0]);
  }
  if (const Vec3 size = Bounds(mesh.positions).Size();
      options.widest_across && size.z > size.x) {
    for (Vec3& p : mesh.positions) {
      p = {p.z, p.y, -p.x};
    }
  }
  const Bounds bounds(mesh.positions);
  const Vec3 size = bounds.Size();
  if (!(size.x > 1e-6F * std::max(size.y, size.z))) {
    throw BadData("the mesh has no width in x, by which it would be scaled");
  }
  const auto width = static_cast<float>(options.width_mm);
  const auto highest = static_cast<float>(options.highest);
  const float scale = width / std::max(size.x, size.y / highest);
  const Vec3 middle = (bounds.low + bounds.high) * 0.5F;
  for (Vec3& p : mesh.positions) {
    p = (p - Vec3{middle.x, bounds.low.y, middle.z}) * scale;
  }
  summary.size_mm = size * scale;
}

/// The sides a face can look to, and the axes of their texture: u to the right and v up
/// as seen from outside.
struct Side {
  Vec3 normal;
  Vec3 u;
  Vec3 v;
};
constexpr std::array<Side, 6> kSides{{{{1, 0, 0}, {0, 0, -1}, {0, 1, 0}},
                                      {{-1, 0, 0}, {0, 0, 1}, {0, 1, 0}},
                                      {{0, 1, 0}, {1, 0, 0}, {0, 0, -1}},
                                      {{0, -1, 0}, {1, 0, 0}, {0, 0, 1}},
                                      {{0, 0, 1}, {1, 0, 0}, {0, 1, 0}},
                                      {{0, 0, -1}, {-1, 0, 0}, {0, 1, 0}}}};

std::size_t SideOf(Vec3 normal) {
  std::size_t best = 0;
  for (std::size_t s = 1; s < kSides.size(); ++s) {
    if (Dot(normal, kSides[s].normal) > Dot(normal, kSides[best].normal)) {
      best = s;
    }
  }
  return best;
}

/// A side for each face, by normals smoothed over the neighbourhood, so that charts are
/// few and their borders short; never a side that the face itself is steep to.
std::vector<std::size_t> ChooseSides(const TriangleMesh& mesh) {
  constexpr int kRounds = 12;
  constexpr float kSteepest = 0.35F;
  std::vector<Vec3> normals = mesh.normals;
  for (int round = 0; round < kRounds; ++round) {
    std::vector<Vec3> sums(normals.size());
    for (const auto& t : mesh.triangles) {
      const Vec3 sum = normals[t[0]] + normals[t[1]] + normals[t[2]];
      for (const std::uint32_t index : t) {
        sums[index] += sum;
      }
    }
    for (std::size_t i = 0; i < sums.size(); ++i) {
      const float length = Length(sums[i]);
      normals[i] = length > 0 ? sums[i] / length : normals[i];
    }
  }
  std::vector<std::size_t> sides;
  sides.reserve(mesh.triangles.size());
  for (const auto& t : mesh.triangles) {
    const Vec3 own = Normalized(Cross(mesh.positions[t[1]] - mesh.positions[t[0]],
                                      mesh.positions[t[2]] - mesh.positions[t[0]]));
    const std::size_t side = SideOf(normals[t[0]] + normals[t[1]] + normals[t[2]]);
    sides.push_back(Dot(own, kSides[side].normal) > kSteepest ? side : SideOf(own));
  }
  return sides;
}

void ProjectTexture(TriangleMesh& mesh, double width_mm) {
  const std::vector<std::size_t> sides = ChooseSides(mesh);
  TriangleMesh split;
  std::unordered_map<std::uint64_t, std::uint32_t> index_of;
  const float per_mm = 1 / static_cast<float>(width_mm);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Side& side = kSides[sides[i]];
    auto triangle = mesh.triangles[i];
    for (std::uint32_t& index : triangle) {
      const auto [place, added] =
          index_of.try_emplace(std::uint64_t{index} * kSides.size() + sides[i],
                               static_cast<std::uint32_t>(split.positions.size()));
      if (added) {
        const Vec3 p = mesh.positions[index];
        split.positions.push_back(p);
        split.normals.push_back(mesh.normals[index]);
        split.uvs.push_back(
            {0.5F + Dot(p, side.u) * per_mm, 0.5F + Dot(p, side.v) * per_mm});
      }
      index = place->second;
    }
    split.triangles.push_back(triangle);
  }
  mesh = std::move(split);
}

}  // namespace

MeshPrepareSummary PrepareMesh(TriangleMesh& mesh, const MeshPrepareOptions& options) {
  Validate(options);
  if (options.up != "x" && options.up != "y" && options.up != "z") {
    throw UsageError("up: '" + options.up + "' isn't one of x, y and z");
  }
  MeshPrepareSummary summary;
  summary.vertices_read = static_cast<std::int64_t>(mesh.positions.size());
  Weld(mesh);
  summary.degenerate_triangles_dropped =
      CheckMesh(mesh, "mesh").degenerate_triangles_dropped;
  SelectComponents(mesh, options.largest_component, summary);
  DropUnusedVertices(mesh);
  PlaceMesh(mesh, options, summary);
  ComputeNormals(mesh);
  summary.area_mm2 = SurfaceArea(mesh);
  ProjectTexture(mesh, options.width_mm);
  summary.vertices = static_cast<std::int64_t>(mesh.positions.size());
  summary.triangles = static_cast<std::int64_t>(mesh.triangles.size());
  return summary;
}

std::string MeshPrepareSummary::Brief() const {
  return fmt::format(
      "{} triangles, {} vertices, {:.1f} x {:.1f} x {:.1f} mm, {:.0f} mm^2, {} "
      "part{}{}",
      triangles,
      vertices,
      size_mm.x,
      size_mm.y,
      size_mm.z,
      area_mm2,
      components,
      components == 1 ? "" : "s",
      components_dropped > 0 ? fmt::format(" ({} dropped)", components_dropped) : "");
}

Json MeshPrepareSummary::ToJson() const {
  return {{"vertices_read", vertices_read},
          {"vertices", vertices},
          {"triangles", triangles},
          {"degenerate_triangles_dropped", degenerate_triangles_dropped},
          {"components", components},
          {"components_dropped", components_dropped},
          {"size_mm", {size_mm.x, size_mm.y, size_mm.z}},
          {"area_mm2", area_mm2}};
}

}  // namespace nacre::render
