#pragma once

#include "render/subsurface/lit_point_cloud.h"

#include <cstdint>
#include <vector>

namespace nacre::render {

/// An octree over patches in which a node stands for all its patches as one source
/// [Jensen02]. Nodes lie in depth-first order.
class PatchTree {
 public:
  struct Node {
    Vec3 centre_mm;          ///< weighted by flux
    float radius_mm = 0;     ///< around the centre, that its patches reach
    Vec3 normal;             ///< unit
    Color flux_w;            ///< sum over its patches
    float variance_mm2 = 0;  ///< of the flux along one direction in the surface
    std::int32_t begin = 0;  ///< its patches
    std::int32_t end = 0;
    std::int32_t next = 0;       ///< the node after its subtree
    std::int32_t brightest = 0;  ///< its patch of the largest flux
  };

  PatchTree() = default;
  explicit PatchTree(std::vector<Patch> patches);

  const std::vector<Patch>& patches() const { return patches_; }
  const std::vector<Node>& nodes() const { return nodes_; }

  /// Visits every patch nearer to x than `reach_mm` exactly once: on its own,
  /// on_patch(index, x − centre), or as part of a node for which stands(index, squared
  /// distance) says yes, on_node(index, x − centre). What is farther may be visited
  /// too.
  template <class Stands, class OnNode, class OnPatch>
  void Visit(Vec3 x_mm,
             float reach_mm,
             Stands&& stands,
             OnNode&& on_node,
             OnPatch&& on_patch) const {
    const auto node_count = static_cast<std::int32_t>(nodes_.size());
    for (std::int32_t n = 0; n < node_count;) {
      const Node& node = nodes_[static_cast<std::size_t>(n)];
      const Vec3 d = x_mm - node.centre_mm;
      const float distance2 = Dot(d, d);
      const float far = reach_mm + node.radius_mm;
      if (distance2 > far * far) {
        n = node.next;
      } else if (node.end - node.begin > 1 && stands(n, distance2)) {
        on_node(n, d);
        n = node.next;
      } else if (node.next == n + 1) {
        VisitPatches(n, x_mm, on_patch);
        n = node.next;
      } else {
        ++n;
      }
    }
  }

  /// Whether the diameter of a node is less than `max_relative_extent` of a distance.
  auto SmallerThan(float max_relative_extent) const {
    return [this, open2 = 4 / (max_relative_extent * max_relative_extent)](
               std::int32_t n, float distance2) {
      const float radius = nodes_[static_cast<std::size_t>(n)].radius_mm;
      return radius * radius * open2 < distance2;
    };
  }

  /// Calls visit(index) for nodes from the root down to a leaf, of the children always
  /// the one whose centre is nearest to x.
  template <class Visitor>
  void Descend(Vec3 x_mm, Visitor&& visit) const {
    const auto distance2 = [&](std::int32_t n) {
      const Vec3 d = x_mm - nodes_[static_cast<std::size_t>(n)].centre_mm;
      return Dot(d, d);
    };
    for (std::int32_t n = 0; n < static_cast<std::int32_t>(nodes_.size());) {
      visit(n);
      const std::int32_t end = nodes_[static_cast<std::size_t>(n)].next;
      if (end == n + 1) {
        return;
      }
      std::int32_t nearest = n + 1;
      for (std::int32_t child = n + 1; child < end;
           child = nodes_[static_cast<std::size_t>(child)].next) {
        if (distance2(child) < distance2(nearest)) {
          nearest = child;
        }
      }
      n = nearest;
    }
  }

  /// Calls on_patch(index, x − centre) for the patches of one node.
  template <class OnPatch>
  void VisitPatches(std::int32_t n, Vec3 x_mm, OnPatch&& on_patch) const {
    const Node& node = nodes_[static_cast<std::size_t>(n)];
    for (std::int32_t p = node.begin; p < node.end; ++p) {
      on_patch(p, x_mm - positions_mm_[static_cast<std::size_t>(p)]);
    }
  }

 private:
  void Build(std::int32_t begin, std::int32_t end, int level);

  std::vector<Patch> patches_;
  std::vector<Vec3> positions_mm_;  ///< of the patches once more, close together
  std::vector<Node> nodes_;
};

}  // namespace nacre::render
