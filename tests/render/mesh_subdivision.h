#pragma once

#include "render/mesh.h"

namespace nacre::render {

/// Every triangle by four, through the middles of its sides.
inline TriangleMesh Subdivided(const TriangleMesh& mesh) {
  TriangleMesh fine = mesh;
  fine.triangles.clear();
  const auto middle = [&](std::uint32_t a, std::uint32_t b) {
    const auto index = static_cast<std::uint32_t>(fine.positions.size());
    fine.positions.push_back((fine.positions[a] + fine.positions[b]) * 0.5F);
    if (!fine.normals.empty()) {
      fine.normals.push_back(Normalized(fine.normals[a] + fine.normals[b]));
    }
    if (!fine.uvs.empty()) {
      const Vec2 u = fine.uvs[a];
      const Vec2 v = fine.uvs[b];
      fine.uvs.push_back({0.5F * (u.x + v.x), 0.5F * (u.y + v.y)});
    }
    return index;
  };
  for (const auto& [a, b, c] : mesh.triangles) {
    const std::uint32_t ab = middle(a, b);
    const std::uint32_t bc = middle(b, c);
    const std::uint32_t ca = middle(c, a);
    fine.triangles.insert(fine.triangles.end(),
                          {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
  }
  return fine;
}

}  // namespace nacre::render
