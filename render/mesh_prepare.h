#pragma once

#include "core/json_fwd.h"
#include "core/options.h"
#include "render/mesh.h"

#include <cstdint>
#include <string>

namespace nacre::render {

struct MeshPrepareOptions {
  double width_mm = 126;           ///< extent in x, and side of a tile of the texture
  double highest = 0.75;           ///< in widths; what is higher is made smaller
  std::string up = "y";            ///< the axis that points up in the file
  bool widest_across = true;       ///< a quarter turn if it is deeper than wide
  bool largest_component = false;  ///< keep only what hangs together and is largest

  template <class Self, class Visitor>
  static void Visit(Self& self, Visitor&& visit) {
    visit("width_mm",
          self.width_mm,
          Range{1e-6, 1e6},
          "extent in x, and side of one tile of the texture coordinates, mm");
    visit("highest",
          self.highest,
          Range{1e-3, 1e3},
          "greatest height in widths; what is higher is made smaller");
    visit("widest_across",
          self.widest_across,
          Range{},
          "turn by a quarter, about the upright axis, what is deeper than wide");
    visit("up", self.up, Range{}, "the axis that points up in the file: x, y or z");
    visit("largest_component",
          self.largest_component,
          Range{},
          "keep only the connected part with the largest area");
  }
};

struct MeshPrepareSummary {
  std::int64_t vertices_read = 0;
  std::int64_t vertices = 0;  ///< after splitting at the borders of charts
  std::int64_t triangles = 0;
  std::int64_t degenerate_triangles_dropped = 0;
  std::int64_t components = 0;
  std::int64_t components_dropped = 0;
  Vec3 size_mm;
  double area_mm2 = 0;

  std::string Brief() const;
  Json ToJson() const;
};

/// Makes a scan ready to be given a measured material:
/// - vertices at the same place become one, faces without area go;
/// - upright (+y up), its wider side along x, `width_mm` wide (less if it would be too
///   high), standing on y = 0, centred in x and z;
/// - smooth normals;
/// - texture coordinates by projection along the axis that a face looks along most, one
///   tile for each `width_mm`, never mirrored seen from outside, so that a sample
///   `width_mm` wide lies on the object at its own scale. Between faces that look along
///   different axes, vertices are split.
/// Throws a usage Error for options out of range, BadData if the mesh is flat in x.
MeshPrepareSummary PrepareMesh(TriangleMesh& mesh, const MeshPrepareOptions& options);

}  // namespace nacre::render
