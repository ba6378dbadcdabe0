#pragma once

#include "rigs/pattern.h"
#include "rigs/phantom.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

namespace nacre::rigs::monte_carlo {

/// What light meets in one medium, for one channel.
struct Optics {
  double sigma_a_per_mm = 0;
  double sigma_s_per_mm = 0;
  double g = 0;  ///< mean cosine of Henyey and Greenstein's phase function

  double SigmaT() const { return sigma_a_per_mm + sigma_s_per_mm; }
};

/// A layer between two planes; may be infinitely thick if it is the last.
struct Layer {
  double thickness_mm = std::numeric_limits<double>::infinity();
  double eta = 1;
  std::size_t medium = 0;  ///< index into Volume::media; patterns and voxels ignore it
};

/// Media a voxel, x fastest, then y (upwards), then z (downwards, from the surface).
/// Points outside belong to the nearest voxel.
struct VoxelGrid {
  std::array<int, 3> count{};
  std::array<double, 3> size_mm{};  ///< of one voxel
  double left_mm = 0;               ///< x of the grid's left face
  double lower_mm = 0;              ///< y of its lower face
  std::vector<std::uint16_t> medium{};

  std::size_t MediumAt(double x_mm, double y_mm, double depth_mm) const;
};

/// Side faces, around the axis: |x| ≤ half_x_mm, |y| ≤ half_y_mm. Light that crosses
/// them is refracted into air as at the top.
struct Box {
  double half_x_mm = 0;
  double half_y_mm = 0;
};

/// What photons travel in, for one channel. x and y as in the sample plane; depth grows
/// downwards from the top surface, above which is air. At most one of pattern, voxels
/// and several layers. In a volume without interfaces set eta = 1.
struct Volume {
  std::vector<Optics> media;
  std::vector<Layer> layers;  ///< from the top; at least one
  Pattern pattern;            ///< media 0 and 1
  std::optional<VoxelGrid> voxels;
  std::optional<Box> box;
  Bottom bottom = Bottom::kAir;

  double DepthMm() const;  ///< of all layers; may be infinite
  /// Of one-layer volumes.
  std::size_t MediumAt(double x_mm, double y_mm, double depth_mm) const;
};

/// Throws BadData naming what makes no sense, or what no exact simulation ends for: an
/// infinitely thick volume without absorption, whose photons travel infinitely far on
/// average.
void Validate(const Volume& volume);

/// One channel of a phantom.
Volume MakeVolume(const Phantom& phantom, std::size_t channel);

}  // namespace nacre::rigs::monte_carlo
