#pragma once

#include "render/subsurface/subsurface.h"

#include <cstdint>
#include <functional>
#include <vector>

namespace nacre::render {

/// A small piece of lit surface, treated as one source.
struct Patch {
  SurfacePoint point;       ///< at the centre of its flux; frame and uv of a member
  Color flux_w;             ///< Σ area · flux density of its members: exact
  float area_mm2 = 0;       ///< Σ area of its members
  Vec3 axis_a_mm;           ///< standard deviation of its shape along its longer side,
  Vec3 axis_b_mm;           ///< and along its shorter one, both in the tangent plane
  std::uint64_t voxel = 0;  ///< Morton code of its voxel; patches are sorted by it
};

/// Gathers lit points into patches: one for each voxel of side `side_mm` and each of
/// the six directions a normal can mostly point in, so that the two faces of something
/// thin stay apart. Texture coordinates aren't averaged (they jump at seams): a patch
/// has those of the member nearest to its centre. Points without flux are dropped. The
/// result is the same for any order of the points.
/// Throws a usage Error for a point that isn't finite, or if the points reach over more
/// than 2²⁰ voxels.
///
/// Points of which `part_of` says different things never share a patch.
using PartFunction = std::function<int(const SurfacePoint&)>;
std::vector<Patch> GatherPatches(const std::vector<LitPoint>& lit,
                                 float side_mm,
                                 const PartFunction& part_of = {},
                                 int thread_count = 1);

}  // namespace nacre::render
