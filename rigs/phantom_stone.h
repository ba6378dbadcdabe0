#pragma once

#include "core/options.h"
#include "rigs/phantom_voxels.h"

#include <cstdint>

namespace nacre::rigs {

/// Veined marble. Veins are where a warped noise field passes through zero: curved
/// sheets that cross the stone, of a width that varies along them, with finer ones
/// between, a stain around the wide ones and a faint cloud in the ground.
struct VeinOptions {
  int seed = 1;
  double scale_mm = 12;       ///< distance of the large veins, roughly
  double width_mm = 0.8;      ///< of a large vein at half its depth of colour
  double warp = 0.8;          ///< how far veins wander, in scales
  double fine = 0.5;          ///< colour of the fine veins against the large ones'
  double cloud = 0.12;        ///< colour of the ground
  double direction_deg = 30;  ///< veins run along it, counter-clockwise from +x
  double stretch = 2;         ///< they are so many times longer than apart

  template <class Self, class Visitor>
  static void Visit(Self& self, Visitor&& visit) {
    visit("seed", self.seed, Range{0, 2e9}, "");
    visit("scale_mm", self.scale_mm, Range{1e-3, 1e5}, "");
    visit("width_mm", self.width_mm, Range{1e-4, 1e5}, "");
    visit("warp", self.warp, Range{0, 10}, "");
    visit("fine", self.fine, Range{0, 1}, "");
    visit("cloud", self.cloud, Range{0, 1}, "");
    visit("direction_deg", self.direction_deg, Range{-360, 360}, "");
    visit("stretch", self.stretch, Range{0.1, 100}, "");
  }
};

/// Banded onyx: layers laid down one upon another around a bumpy front, each of its own
/// colour and thickness, some sharp, some passing into the next.
struct OnyxOptions {
  int seed = 1;
  double band_mm = 3;         ///< mean thickness of a band
  double warp = 1.5;          ///< how bumpy the front is, in bands
  double scale_mm = 25;       ///< size of the bumps
  double sharpness = 0.6;     ///< 0: bands pass into each other, 1: all edges are sharp
  double direction_deg = 60;  ///< the front moves along it, counter-clockwise from +x
  double dip_deg = 20;        ///< and this much downwards

  template <class Self, class Visitor>
  static void Visit(Self& self, Visitor&& visit) {
    visit("seed", self.seed, Range{0, 2e9}, "");
    visit("band_mm", self.band_mm, Range{1e-3, 1e5}, "");
    visit("warp", self.warp, Range{0, 100}, "");
    visit("scale_mm", self.scale_mm, Range{1e-3, 1e5}, "");
    visit("sharpness", self.sharpness, Range{0, 1}, "");
    visit("direction_deg", self.direction_deg, Range{-360, 360}, "");
    visit("dip_deg", self.dip_deg, Range{-90, 90}, "");
  }
};

/// Where in a chain of media (ChainPalette) a point of the stone lies, in [0, 1]: pure
/// functions of the options and the point. Marble: 0 is the ground, 1 the middle of a
/// vein.
VoxelFunction MarbleMixture(const VeinOptions& options);
VoxelFunction OnyxMixture(const OnyxOptions& options);

}  // namespace nacre::rigs
