#pragma once

#include "reconstruct/internal/hdr_merge.h"

#include <array>
#include <cstddef>
#include <vector>

namespace nacre::reconstruct::internal {

/// Sums over the pixels around a spot by their distance from it, a third of a pixel a
/// ring. Floats: they are kept by the thousand (see GroupSpool).
struct SpotRings {
  static constexpr std::size_t kCount = 18;
  using Values = std::array<float, kCount>;
  Values sum{};         ///< of rates
  Values pixels{};      ///< how many
  Values square_mm2{};  ///< Σ r²

  bool empty() const;  ///< of a spot that couldn't be seen whole
  void Add(const SpotRings& other);
  float Mean(std::size_t ring) const { return sum[ring] / pixels[ring]; }
  double RadiusMm(std::size_t ring) const;  ///< rms
};

/// Looks around spots in pictures of one camera. Pixels of a colour that the laser
/// doesn't pass well, and hot ones, are left out.
class RingReader {
 public:
  /// `calibration` must outlive this; its corrections count, the surface is seen by
  /// `camera`.
  RingReader(const calibrate::Calibration& calibration,
             const calibrate::CameraGeometry& camera);

  /// Of light behind the flat field; rings are `ring_mm` wide. Empty if a pixel near
  /// the spot is saturated or beyond the picture's edge.
  SpotRings Around(const RateFrame& rates,
                   int channel,
                   PointMm spot,
                   double ring_mm) const;

  /// A third of a pixel in the middle of the picture.
  double RingMm() const;

  std::size_t MemoryBytes() const {
    return weight_.size() * (weight_.empty() ? 0 : weight_[0].size()) * sizeof(float);
  }

 private:
  calibrate::CameraGeometry camera_;
  /// A channel, a pixel: 1 / flat field, 0 where it is left out.
  std::vector<std::vector<float>> weight_;
};

}  // namespace nacre::reconstruct::internal
