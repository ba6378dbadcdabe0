#pragma once

#include "calibrate/calibration.h"
#include "reconstruct/internal/glare_pyramid.h"
#include "reconstruct/internal/hdr_merge.h"
#include "reconstruct/internal/pixel_boxes.h"
#include "reconstruct/internal/pixel_cells.h"
#include "reconstruct/rd_dataset.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace nacre::reconstruct::internal {

/// What else goes into the weights.
struct PixelModel {
  PlaceOnLattice place = {};
  std::span<const float> factor = {};  ///< a value a pixel is multiplied by; empty: 1
  bool with_bins = false;              ///< MeansOfBins will be asked for
};

/// The mean of a picture over a cell is a weighted sum of pixels: the weights of all
/// cells. Radiance is taken to vary linearly within a pixel that a cell's edge cuts,
/// with the slopes to its neighbours; and the blur of a Gaussian spot of
/// `spot_sigma_mm` is undone to fourth order in the derivatives. Both move light
/// between neighbours and keep its sum.
class CellWeights {
 public:
  CellWeights(const CellLattice& lattice,
              const calibrate::CameraGeometry& camera,
              const calibrate::SpotProfile& spot,
              int thread_count,
              const PixelModel& pixels = {});

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

  /// Of all cells; what the picture was binned from is taken to be even over a bin.
  void MeansOfBins(const BinnedPicture& picture, std::span<float> means) const;

  std::size_t MemoryBytes() const { return pixels_.Bytes() + bins_.Bytes(); }

 private:
  class BoxBuilder;  // the boxes of some rows of cells

  CellLattice lattice_;
  PixelBoxes pixels_;
  PixelBoxes bins_;  // the same weights, added up in bins
};

}  // namespace nacre::reconstruct::internal
