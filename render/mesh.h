#pragma once

#include "render/vec.h"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace nacre::render {

/// Triangles with an attribute set a vertex. `normals` and `uvs` are either empty or of
/// the size of `positions`.
struct TriangleMesh {
  std::vector<Vec3> positions;  ///< scene units
  std::vector<Vec3> normals;    ///< unit, outward; empty: flat faces
  std::vector<Vec2> uvs;        ///< (0, 0) lower left, (1, 1) upper right
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< counter-clockwise outside

  float TriangleArea(std::size_t triangle) const;
};

/// What CheckMesh changed or found.
struct MeshReport {
  std::int64_t degenerate_triangles_dropped = 0;
};

/// Throws BadData naming `origin` for an index out of range, an attribute array of the
/// wrong size, or a position, normal or uv that isn't finite; drops triangles without
/// area and normalises the normals (a normal of length 0 is replaced by the mean of the
/// faces around it).
MeshReport CheckMesh(TriangleMesh& mesh, const std::string& origin);

/// Smooth normals: faces around a vertex, weighted by their angle there
/// [Thürmer & Wüthrich 98].
void ComputeNormals(TriangleMesh& mesh);

/// Sum of the triangles' areas, in scene units squared.
double SurfaceArea(const TriangleMesh& mesh);

/// The shapes with a closed form that are made of triangles here, in Mitsuba's sizes:
/// [−1, 1]² in the xy plane, normal +z, uv (0, 0) at (−1, −1); the unit disk; [−1, 1]³.
TriangleMesh MakeRectangle();
TriangleMesh MakeDisk();
TriangleMesh MakeCube();

}  // namespace nacre::render
