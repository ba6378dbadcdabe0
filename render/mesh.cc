#include "render/mesh.h"

#include "core/error.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numbers>

namespace nacre::render {
namespace {

bool IsFinite(Vec3 v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

void CheckSizes(const TriangleMesh& mesh, const std::string& origin) {
  const auto check = [&](std::size_t size, const char* what) {
    if (size != 0 && size != mesh.positions.size()) {
      throw BadData(fmt::format(
          "{}: {} {} for {} vertices", origin, size, what, mesh.positions.size()));
    }
  };
  check(mesh.normals.size(), "normals");
  check(mesh.uvs.size(), "texture coordinates");
  for (const auto& triangle : mesh.triangles) {
    for (const std::uint32_t index : triangle) {
      if (index >= mesh.positions.size()) {
        throw BadData(fmt::format("{}: a face uses vertex {}, but there are only {}",
                                  origin,
                                  index,
                                  mesh.positions.size()));
      }
    }
  }
}

void CheckFinite(const TriangleMesh& mesh, const std::string& origin) {
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    if (!IsFinite(mesh.positions[i])) {
      throw BadData(
          fmt::format("{}: the position of vertex {} isn't finite; export "
                      "the mesh again",
                      origin,
                      i));
    }
    if (!mesh.normals.empty() && !IsFinite(mesh.normals[i])) {
      throw BadData(fmt::format("{}: the normal of vertex {} isn't finite", origin, i));
    }
    if (!mesh.uvs.empty() &&
        !(std::isfinite(mesh.uvs[i].x) && std::isfinite(mesh.uvs[i].y))) {
      throw BadData(fmt::format(
          "{}: the texture coordinate of vertex {} isn't finite", origin, i));
    }
  }
}

float CornerAngle(Vec3 corner, Vec3 a, Vec3 b) {
  const Vec3 u = a - corner;
  const Vec3 v = b - corner;
  return std::atan2(Length(Cross(u, v)), Dot(u, v));
}

std::vector<Vec3> SmoothNormals(const TriangleMesh& mesh) {
  std::vector<Vec3> sums(mesh.positions.size());
  for (const auto& t : mesh.triangles) {
    const std::array<Vec3, 3> p = {
        mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]};
    const Vec3 cross = Cross(p[1] - p[0], p[2] - p[0]);
    const float length = Length(cross);
    if (!(length > 0)) {
      continue;
    }
    for (std::size_t k = 0; k < 3; ++k) {
      sums[t[k]] +=
          cross * (CornerAngle(p[k], p[(k + 1) % 3], p[(k + 2) % 3]) / length);
    }
  }
  for (Vec3& n : sums) {
    const float length = Length(n);
    n = length > 0 ? n / length : Vec3{0, 0, 1};  // a vertex of no face: any will do
  }
  return sums;
}

}  // namespace

float TriangleMesh::TriangleArea(std::size_t triangle) const {
  const auto& t = triangles[triangle];
  return 0.5F * Length(Cross(positions[t[1]] - positions[t[0]],
                             positions[t[2]] - positions[t[0]]));
}

MeshReport CheckMesh(TriangleMesh& mesh, const std::string& origin) {
  CheckSizes(mesh, origin);
  CheckFinite(mesh, origin);
  MeshReport report;
  std::vector<std::array<std::uint32_t, 3>> kept;
  kept.reserve(mesh.triangles.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    if (mesh.TriangleArea(i) > 0) {
      kept.push_back(mesh.triangles[i]);
    }
  }
  report.degenerate_triangles_dropped =
      static_cast<std::int64_t>(mesh.triangles.size() - kept.size());
  mesh.triangles = std::move(kept);
  if (mesh.triangles.empty()) {
    throw BadData(origin + ": no triangle with an area");
  }
  if (!mesh.normals.empty()) {
    std::vector<Vec3> smooth;
    for (std::size_t i = 0; i < mesh.normals.size(); ++i) {
      const float length = Length(mesh.normals[i]);
      if (length > 0) {
        mesh.normals[i] = mesh.normals[i] / length;
        continue;
      }
      if (smooth.empty()) {
        smooth = SmoothNormals(mesh);
      }
      mesh.normals[i] = smooth[i];
    }
  }
  return report;
}

void ComputeNormals(TriangleMesh& mesh) {
  mesh.normals = SmoothNormals(mesh);
}

double SurfaceArea(const TriangleMesh& mesh) {
  double sum = 0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    sum += static_cast<double>(mesh.TriangleArea(i));
  }
  return sum;
}

TriangleMesh MakeRectangle() {
  TriangleMesh mesh;
  mesh.positions = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
  mesh.normals.assign(4, {0, 0, 1});
  mesh.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

TriangleMesh MakeDisk() {
  // The polygon has the area of the disk to 4 parts in a million.
  constexpr std::uint32_t kSegments = 1024;
  TriangleMesh mesh;
  mesh.positions.push_back({0, 0, 0});
  mesh.uvs.push_back({0.5F, 0.5F});
  for (std::uint32_t i = 0; i < kSegments; ++i) {
    const float phi = 2 * std::numbers::pi_v<float> * static_cast<float>(i) / kSegments;
    const float x = std::cos(phi);
    const float y = std::sin(phi);
    mesh.positions.push_back({x, y, 0});
    mesh.uvs.push_back({0.5F + 0.5F * x, 0.5F + 0.5F * y});
    mesh.triangles.push_back({0, 1 + i, 1 + (i + 1) % kSegments});
  }
  mesh.normals.assign(mesh.positions.size(), {0, 0, 1});
  return mesh;
}

TriangleMesh MakeCube() {
  TriangleMesh mesh;
  for (int axis = 0; axis < 3; ++axis) {
    for (const float side : {-1.0F, 1.0F}) {
      const auto base = static_cast<std::uint32_t>(mesh.positions.size());
      const auto place = [&](float along_normal, float a, float b) {
        return axis == 0   ? Vec3{along_normal, a, b}
               : axis == 1 ? Vec3{b, along_normal, a}
                           : Vec3{a, b, along_normal};
      };
      for (const Vec2 corner : {Vec2{-1, -1}, Vec2{1, -1}, Vec2{1, 1}, Vec2{-1, 1}}) {
        // Mirrored on the negative sides, so that all faces are counter-clockwise.
        mesh.positions.push_back(place(side, side * corner.x, corner.y));
        mesh.normals.push_back(place(side, 0, 0));
        mesh.uvs.push_back({0.5F + 0.5F * corner.x, 0.5F + 0.5F * corner.y});
      }
      mesh.triangles.push_back({base, base + 1, base + 2});
      mesh.triangles.push_back({base, base + 2, base + 3});
    }
  }
  return mesh;
}

}  // namespace nacre::render
