#include "render/subsurface/patch_tree.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace nacre::render {
namespace {

constexpr int kLevels = 20;
constexpr std::int32_t kLeafPatches = 4;

PatchTree::Node Summarize(const std::vector<Patch>& patches,
                          std::int32_t begin,
                          std::int32_t end) {
  PatchTree::Node node;
  node.begin = begin;
  node.end = end;
  node.brightest = begin;
  double weight_sum = 0;
  float brightest = 0;
  std::array<double, 3> flux{};
  std::array<double, 3> centre{};
  std::array<double, 3> normal{};  // its squares are beyond floats in very bright light
  for (std::int32_t p = begin; p < end; ++p) {
    const Patch& patch = patches[static_cast<std::size_t>(p)];
    const float weight = patch.flux_w.x + patch.flux_w.y + patch.flux_w.z;
    weight_sum += static_cast<double>(weight);
    for (int c = 0; c < 3; ++c) {
      const auto i = static_cast<std::size_t>(c);
      flux[i] += static_cast<double>(patch.flux_w[c]);
      centre[i] += static_cast<double>(weight * patch.point.position_mm[c]);
      normal[i] += static_cast<double>(weight * patch.point.normal[c]);
    }
    if (weight > brightest) {
      brightest = weight;
      node.brightest = p;
    }
  }
  node.flux_w = {static_cast<float>(flux[0]),
                 static_cast<float>(flux[1]),
                 static_cast<float>(flux[2])};
  node.centre_mm = {static_cast<float>(centre[0] / weight_sum),
                    static_cast<float>(centre[1] / weight_sum),
                    static_cast<float>(centre[2] / weight_sum)};
  const double normal_length = std::hypot(normal[0], normal[1], normal[2]);
  node.normal = normal_length > 0
                    ? Vec3{static_cast<float>(normal[0] / normal_length),
                           static_cast<float>(normal[1] / normal_length),
                           static_cast<float>(normal[2] / normal_length)}
                    : patches[static_cast<std::size_t>(node.brightest)].point.normal;
  double variance = 0;
  for (std::int32_t p = begin; p < end; ++p) {
    const Patch& patch = patches[static_cast<std::size_t>(p)];
    const Vec3 d = patch.point.position_mm - node.centre_mm;
    const float own =
        Dot(patch.axis_a_mm, patch.axis_a_mm) + Dot(patch.axis_b_mm, patch.axis_b_mm);
    const float weight = patch.flux_w.x + patch.flux_w.y + patch.flux_w.z;
    variance += static_cast<double>(weight * 0.5F * (Dot(d, d) + own));
    node.radius_mm = std::max(node.radius_mm, Length(d) + Length(patch.axis_a_mm));
  }
  node.variance_mm2 = static_cast<float>(variance / weight_sum);
  return node;
}

}  // namespace

PatchTree::PatchTree(std::vector<Patch> patches) : patches_(std::move(patches)) {
  positions_mm_.reserve(patches_.size());
  for (const Patch& patch : patches_) {
    positions_mm_.push_back(patch.point.position_mm);
  }
  nodes_.reserve(patches_.size() / 2 + 1);
  if (!patches_.empty()) {
    Build(0, static_cast<std::int32_t>(patches_.size()), kLevels - 1);
  }
}

void PatchTree::Build(std::int32_t begin, std::int32_t end, int level) {
  const auto voxel = [&](std::int32_t p) {
    return patches_[static_cast<std::size_t>(p)].voxel;
  };
  // Levels on which all patches lie in one child would add nodes that say nothing new.
  while (level >= 0 && voxel(begin) >> (3 * level) == voxel(end - 1) >> (3 * level)) {
    --level;
  }
  const std::size_t self = nodes_.size();
  nodes_.push_back(Summarize(patches_, begin, end));
  if (end - begin > kLeafPatches && level >= 0) {
    for (std::int32_t first = begin; first < end;) {
      const std::uint64_t octant = voxel(first) >> (3 * level);
      std::int32_t last = first + 1;
      while (last < end && voxel(last) >> (3 * level) == octant) {
        ++last;
      }
      Build(first, last, level - 1);
      first = last;
    }
  }
  nodes_[self].next = static_cast<std::int32_t>(nodes_.size());
}

}  // namespace nacre::render
