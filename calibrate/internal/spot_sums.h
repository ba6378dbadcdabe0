#pragma once

#include "calibrate/calibration.h"

#include <cstddef>
#include <vector>

namespace nacre::calibrate::internal {

/// Pixel centres and areas on the sample plane.
struct PixelGround {
  std::vector<PointMm> centre;
  std::vector<double> area_mm2;
  int width = 0;
};
PixelGround MapPixels(const CameraGeometry& camera);

/// Sums over the pixels around each spot of a lattice.
class SpotSums {
 public:
  /// `shares`: how much each pixel counts (see PixelShares). `reach_mm`: of the discs;
  /// `core_mm`: so near that second moments aren't noise.
  SpotSums(const PixelGround& ground,
           const std::vector<float>& shares,
           const std::vector<PointMm>& spots,
           double reach_mm,
           double core_mm);

  /// Σ rate · footprint of one picture for each spot.
  std::vector<double> Of(const std::vector<float>& rates) const;

  /// The variance of those sums from the pixels' own, and from that which the pixels of
  /// a row have in common.
  std::vector<double> Variances(const std::vector<double>& pixels, double row) const;

  /// Over how many pixels a spot's light is spread, as averages of speckle go:
  /// (Σ w)² / Σ w². The mean over spots.
  double PixelsASpot(const std::vector<float>& rates) const;

  /// Second moments about each spot's own centre, less a pixel's own; their mean, and
  /// the standard uncertainty of that from their scatter.
  SpotProfile Profile(const PixelGround& ground, const std::vector<float>& rates) const;

  /// The radius that holds that share of the light around the spots, all taken
  /// together, less what a pixel's own width adds in squares. Tails hardly move it.
  double RadiusMm(const PixelGround& ground,
                  const std::vector<PointMm>& spots,
                  const std::vector<float>& rates,
                  double share) const;

 private:
  struct Member {
    std::size_t pixel;
    std::size_t spot;
    double area_mm2;  // that it stands for
    bool is_core;
  };
  std::size_t width_;
  std::size_t spot_count_;
  std::vector<Member> members_;
};

}  // namespace nacre::calibrate::internal
