#pragma once

#include "rigs/plane_map.h"
#include "rigs/transport/transport.h"

#include <cstddef>
#include <vector>

namespace nacre::rigs {

/// One spot as the tiles need it.
struct TileSpot {
  PointMm centre;
  double entering_mw = 0;
  std::size_t channel = 0;
  double reach_mm = 0;  ///< tiles farther than that are left out
};

/// Adds what a spot makes leave to a picture of exitance, band by band. Away from the
/// spot log R_d is so smooth that a biquadratic through 3 × 3 points stands for a tile
/// of 16 × 16 pixels; four more points tell whether it does. Where they disagree by
/// more than 0.07 % (light crosses into another medium there) the tile is quartered,
/// and its quarters' pixels are computed one by one if need be. Pixels near the spot,
/// where R_d changes within a pixel, are means over their footprints.
///
/// Everything depends on the picture alone: the same bits for any number of threads.
class LaserTiles {
 public:
  static constexpr int kBandRows = 16;

  LaserTiles(const PlaneMap& map, const Transport& sample);

  /// Rows [16 band, 16 band + 16) of `exitance`, a whole picture.
  void AddSpot(const TileSpot& spot, int band, float* exitance) const;

 private:
  struct Tile {
    int column = 0;
    int row = 0;
    int size = 0;
  };
  struct Scratch;

  void AddSmooth(const TileSpot& spot,
                 const std::vector<Tile>& tiles,
                 Scratch& scratch,
                 float* exitance) const;
  void AddRough(const TileSpot& spot, Scratch& scratch, float* exitance) const;
  void AddPixels(const TileSpot& spot, Scratch& scratch, float* exitance) const;
  double Distance(const Tile& tile, PointMm centre) const;
  double BandDistance(int band, PointMm centre) const;

  const PlaneMap& map_;
  const Transport& sample_;
  double pixel_mm_;
};

}  // namespace nacre::rigs
