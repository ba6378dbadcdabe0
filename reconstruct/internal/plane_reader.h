#pragma once

#include "acquire/session.h"
#include "calibrate/calibration.h"
#include "calibrate/mosaic.h"
#include "reconstruct/internal/cell_weights.h"
#include "reconstruct/internal/glare_pyramid.h"
#include "reconstruct/internal/hdr_merge.h"
#include "reconstruct/internal/window_shift.h"
#include "reconstruct/rd_dataset.h"

#include <cstddef>
#include <span>
#include <vector>

namespace nacre::reconstruct::internal {

/// Of all cells: rates, their variances (below 0: not valid) and the glare that was in
/// them.
struct CellValues {
  std::span<float> rate;
  std::span<float> variance;
  std::span<float> glare;
};

/// From the pixels of one plane to cells: the whole picture of a monochrome sensor, a
/// quarter of a mosaic's (calibrate/mosaic.h), which is a picture by itself.
class PlaneReader {
 public:
  /// `calibration` must outlive this.
  PlaneReader(const calibrate::Calibration& calibration,
              const calibrate::MosaicPlane& plane,
              const RdHeader& header,
              const SurfaceModel& surface,
              int thread_count);

  const CellWeights& weights() const { return weights_; }
  const calibrate::CameraGeometry& camera() const { return camera_; }

  /// Means over cells of a merged picture less ambient light and glare; windows moved
  /// to where the beams of `group` were.
  void Read(const RateFrame& picture,
            std::span<const acquire::GridIndex> group,
            CellValues cells) const;

  std::size_t MemoryBytes() const {
    return weights_.MemoryBytes() + shift_.MemoryBytes();
  }

 private:
  RateFrame PixelsOf(const RateFrame& picture) const;
  void TakeAmbient();
  void TakeGlare(const RateFrame& rates, CellValues cells) const;

  const calibrate::Calibration& calibration_;
  calibrate::MosaicPlane plane_;
  calibrate::CameraGeometry camera_;
  CellWeights weights_;
  WindowShift shift_;  // to where the beams really were
  GlarePyramid glare_;
  std::vector<float> ambient_;        // a cell, glare taken away; empty: none
  std::vector<float> ambient_glare_;  // what was taken away
};

}  // namespace nacre::reconstruct::internal
