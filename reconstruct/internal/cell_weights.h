#pragma once

#include "calibrate/calibration.h"
#include "reconstruct/internal/hdr_merge.h"
#include "reconstruct/internal/pixel_cells.h"
#include "reconstruct/rd_dataset.h"

#include <cstddef>
#include <cstdint>
#include <span>
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
              int thread_count,
              const PlaceOnLattice& place = {});

  const CellLattice& lattice() const { return lattice_; }

  struct Value {
    double mean = 0;
    double variance = 0;
    bool valid = false;
  };
  /// Not valid if the camera doesn't see all of the cell or a pixel that sees it is
  /// saturated.
  Value Mean(const RateFrame& frame, std::int64_t cell) const;

  /// The same for cells `first` to `first` + means.size(); a variance below 0 marks
  /// those that aren't valid, whose mean is 0.
  void Means(const RateFrame& frame,
             std::int64_t first,
             std::span<float> means,
             std::span<float> variances) const;

  std::size_t MemoryBytes() const;

 private:
  // A cell's weights are a box of pixels, each row padded to whole vectors.
  struct Box {
    std::size_t first_row = 0;     // in rows_
    std::size_t first_weight = 0;  // in weights_
    int row_count = 0;             // 0: the camera doesn't see all of the cell
    int row_width = 0;
  };

  CellLattice lattice_;
  std::vector<Box> boxes_;
  std::vector<std::uint32_t> rows_;  // the first pixel of each row of each box
  std::vector<float> weights_;
};

}  // namespace nacre::reconstruct::internal
