#pragma once

#include "calibrate/calibration.h"
#include "reconstruct/internal/hdr_merge.h"
#include "reconstruct/internal/pixel_cells.h"
#include "reconstruct/rd_dataset.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace nacre::reconstruct::internal {

/// The mean of a picture over a cell is a weighted sum of pixels: the weights of all
/// cells. Radiance is taken to vary linearly within a pixel that a cell's edge cuts,
/// with the slopes to its neighbours; and the blur of a Gaussian spot of
/// `spot_sigma_mm` is undone to fourth order in the derivatives. Both move light
/// between neighbours and keep its sum.
class CellWeights {
 public:
  CellWeights(const CellLattice& lattice,
              const calibrate::CameraGeometry& camera,
              double spot_sigma_mm,
              int thread_count);

  const CellLattice& lattice() const { return lattice_; }

  struct Value {
    double mean = 0;
    double variance = 0;
    bool valid = false;
  };
  /// Not valid if the camera doesn't see all of the cell or a pixel that sees it is
  /// saturated.
  Value Mean(const RateFrame& frame, std::int64_t cell) const;

  std::size_t MemoryBytes() const;

 private:
  struct Share {
    std::uint32_t pixel;
    float weight;
  };

  CellLattice lattice_;
  std::vector<std::size_t> begin_;  // of a cell's shares; and the end of the last
  std::vector<Share> shares_;
  std::vector<char> covered_;
};

}  // namespace nacre::reconstruct::internal
