#include "rigs/transport/monte_carlo/volume.h"

#include "core/error.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace nacre::rigs::monte_carlo {
namespace {

void CheckMedia(const Volume& volume) {
  for (std::size_t k = 0; k < volume.media.size(); ++k) {
    const Optics& m = volume.media[k];
    if (!(m.sigma_a_per_mm >= 0) || !(m.sigma_s_per_mm >= 0) ||
        !std::isfinite(m.SigmaT()) || !(std::abs(m.g) < 1)) {
      throw BadData(fmt::format(
          "Monte Carlo: medium {} has sigma_a {} /mm, sigma_s {} /mm, g {}; needed are "
          "finite coefficients of at least 0 and a g between -1 and 1",
          k,
          m.sigma_a_per_mm,
          m.sigma_s_per_mm,
          m.g));
    }
  }
}

void CheckLayers(const Volume& volume) {
  if (volume.layers.empty()) {
    throw BadData("Monte Carlo: the volume has no layers; give it at least one");
  }
  for (std::size_t k = 0; k < volume.layers.size(); ++k) {
    const Layer& layer = volume.layers[k];
    const bool last = k + 1 == volume.layers.size();
    if (!(layer.thickness_mm > 0) || (std::isinf(layer.thickness_mm) && !last) ||
        !(layer.eta >= 1) || !std::isfinite(layer.eta) ||
        layer.medium >= volume.media.size()) {
      throw BadData(
          fmt::format("Monte Carlo: layer {} has thickness {} mm, eta {}, medium {} of "
                      "{}; needed are a thickness above 0 (infinite only at the "
                      "bottom), an eta of at least 1 and a medium that exists",
                      k,
                      layer.thickness_mm,
                      layer.eta,
                      layer.medium,
                      volume.media.size()));
    }
  }
}

void CheckVoxels(const VoxelGrid& grid, std::size_t media) {
  std::size_t cells = 1;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (grid.count[axis] < 1 || !(grid.size_mm[axis] > 0)) {
      throw BadData(
          fmt::format("Monte Carlo: voxel grid with {} voxels of {} mm along "
                      "axis {}; both must be above 0",
                      grid.count[axis],
                      grid.size_mm[axis],
                      axis));
    }
    cells *= static_cast<std::size_t>(grid.count[axis]);
  }
  if (cells != grid.medium.size() || cells >= (std::size_t{1} << 30)) {
    throw BadData(fmt::format(
        "Monte Carlo: voxel grid of {} voxels with {} media indices; the numbers must "
        "be equal and below 2^30",
        cells,
        grid.medium.size()));
  }
  if (*std::max_element(grid.medium.begin(), grid.medium.end()) >= media) {
    throw BadData(fmt::format(
        "Monte Carlo: a voxel's medium is not one of the {} there are", media));
  }
}

// Which media light in the last, infinite layer can meet.
bool AbsorbsSomewhere(const Volume& volume) {
  if (volume.voxels || volume.pattern.MediumCount() > 1) {
    return std::any_of(volume.media.begin(), volume.media.end(), [](const Optics& m) {
      return m.sigma_a_per_mm > 0;
    });
  }
  return volume.media[volume.layers.back().medium].sigma_a_per_mm > 0;
}

}  // namespace

std::size_t VoxelGrid::MediumAt(double x_mm, double y_mm, double depth_mm) const {
  const std::array<double, 3> from_corner{x_mm - left_mm, y_mm - lower_mm, depth_mm};
  std::array<std::size_t, 3> index{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    index[axis] = static_cast<std::size_t>(
        std::clamp(std::floor(from_corner[axis] / size_mm[axis]),
                   0.0,
                   static_cast<double>(count[axis] - 1)));
  }
  const auto nx = static_cast<std::size_t>(count[0]);
  const auto ny = static_cast<std::size_t>(count[1]);
  return medium[index[0] + nx * (index[1] + ny * index[2])];
}

double Volume::DepthMm() const {
  double depth = 0;
  for (const Layer& layer : layers) {
    depth += layer.thickness_mm;
  }
  return depth;
}

std::size_t Volume::MediumAt(double x_mm, double y_mm, double depth_mm) const {
  if (voxels) {
    return voxels->MediumAt(x_mm, y_mm, depth_mm);
  }
  if (pattern.MediumCount() > 1) {
    return static_cast<std::size_t>(pattern.MediumAt({x_mm, y_mm}));
  }
  return layers.front().medium;
}

void Validate(const Volume& volume) {
  CheckMedia(volume);
  CheckLayers(volume);
  const bool patterned = volume.pattern.MediumCount() > 1;
  if (patterned && (volume.media.size() < 2 || !(volume.pattern.cell_mm > 0))) {
    throw BadData(
        "Monte Carlo: a pattern needs two media and a cell_mm greater than 0");
  }
  if (volume.voxels) {
    CheckVoxels(*volume.voxels, volume.media.size());
  }
  if ((patterned ? 1 : 0) + (volume.voxels ? 1 : 0) +
          (volume.layers.size() > 1 ? 1 : 0) >
      1) {
    throw BadData(
        "Monte Carlo: a volume is a pattern, a voxel grid or a stack of layers, not "
        "several of them; write such a volume as voxels");
  }
  if (volume.box && (!(volume.box->half_x_mm > 0) || !(volume.box->half_y_mm > 0))) {
    throw BadData("Monte Carlo: a box needs half sides greater than 0");
  }
  if (volume.box && volume.layers.size() > 1) {
    throw BadData("Monte Carlo: side faces are for volumes of one refractive index");
  }
  if (std::isinf(volume.DepthMm()) && !AbsorbsSomewhere(volume)) {
    throw BadData(
        "Monte Carlo: an infinitely thick volume without absorption gives all light "
        "back, but only after paths of infinite mean length; give it a thickness or a "
        "sigma_a greater than 0");
  }
}

}  // namespace nacre::rigs::monte_carlo
