#include "rigs/phantom_inclusions.h"

#include "core/random.h"

#include <algorithm>
#include <cmath>

namespace nacre::rigs {
namespace {

struct Span {
  int begin = 0;
  int end = 0;
};

// The voxels along an axis whose centres may lie within `reach` of `centre`.
Span Within(double centre, double reach, double low, double size, int count) {
  const double first = std::floor((centre - reach - low) / size);
  const double last = std::ceil((centre + reach - low) / size);
  const auto clamped = [&](double index) {
    return static_cast<int>(std::clamp(index, 0.0, static_cast<double>(count)));
  };
  return {clamped(first), clamped(last)};
}

void Fill(const Inclusion& inclusion, const std::array<Span, 3>& span, Voxels& voxels) {
  for (int k = span[2].begin; k < span[2].end; ++k) {
    for (int j = span[1].begin; j < span[1].end; ++j) {
      for (int i = span[0].begin; i < span[0].end; ++i) {
        const auto [x, y, depth] = voxels.layout.Centre(i, j, k);
        if (inclusion.Contains(x, y, depth)) {
          voxels.label[voxels.layout.Index(i, j, k)] =
              static_cast<std::uint16_t>(inclusion.medium);
        }
      }
    }
  }
}

}  // namespace

bool Inclusion::Contains(double x_mm, double y_mm, double depth_mm) const {
  const double dx = x_mm - centre_mm[0];
  const double dy = y_mm - centre_mm[1];
  const double c = std::cos(turn_rad);
  const double s = std::sin(turn_rad);
  const double u = (c * dx + s * dy) / radii_mm[0];
  const double v = (c * dy - s * dx) / radii_mm[1];
  const double w = (depth_mm - centre_mm[2]) / radii_mm[2];
  return u * u + v * v + w * w <= 1;
}

std::vector<Inclusion> Strew(const Strewn& strewn) {
  RandomStream random(strewn.seed, 0x737472657721);
  std::vector<Inclusion> inclusions;
  for (int k = 0; k < strewn.count; ++k) {
    Inclusion inclusion{.medium = strewn.medium};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      inclusion.centre_mm[axis] =
          std::lerp(strewn.low_mm[axis], strewn.high_mm[axis], random.Uniform());
    }
    const double radius =
        std::lerp(strewn.smallest_mm, strewn.largest_mm, random.Uniform());
    inclusion.radii_mm = {radius, radius, radius};
    inclusions.push_back(inclusion);
  }
  return inclusions;
}

Voxels PlaceInclusions(const VoxelLayout& layout,
                       std::size_t medium_count,
                       const std::vector<Inclusion>& inclusions) {
  Voxels voxels{layout, {}, PurePalette(medium_count)};
  voxels.label.assign(layout.VoxelCount(), 0);
  const std::array<double, 3> low{layout.left_mm, layout.lower_mm, 0};
  for (const Inclusion& inclusion : inclusions) {
    const double sideways = std::max(inclusion.radii_mm[0], inclusion.radii_mm[1]);
    const std::array<double, 3> reach{sideways, sideways, inclusion.radii_mm[2]};
    std::array<Span, 3> span;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      span[axis] = Within(inclusion.centre_mm[axis],
                          reach[axis],
                          low[axis],
                          layout.size_mm[axis],
                          layout.count[axis]);
    }
    Fill(inclusion, span, voxels);
  }
  return voxels;
}

}  // namespace nacre::rigs
