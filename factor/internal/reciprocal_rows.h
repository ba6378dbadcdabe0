#pragma once

#include "factor/internal/reciprocal_fit.h"
#include "factor/internal/reciprocal_taps.h"

#include <vector>

namespace nacre::factor::internal {

/// One row of pairs at an offset, in a channel: what maps and kernels add up to, its
/// derivatives, and sums of them back into maps. Arrays run over x from area.x0.
class ReciprocalRows {
 public:
  ReciprocalRows(const ReciprocalData& data,
                 const ReciprocalFit& fit,
                 std::size_t channel,
                 std::size_t cell);

  const PlaneArea& area() const { return area_; }
  std::size_t Points() const { return static_cast<std::size_t>(area_.x1 - area_.x0); }

  /// To be called first for a row y of the first points.
  void Look(int y);
  /// The logarithm of R_d over the peak.
  void Model(float* s) const;
  /// Its change along a change of the maps.
  void Along(const SharedMaps& change, float* s);
  /// Adds what a change of s by `r` means to the maps.
  void Back(const float* r, SharedMaps& gradient);
  /// Adds to each point's block of the normal equations, rows (j, k ≤ j), at weights w.
  void Blocks(const float* w, SharedMaps& blocks);

 private:
  std::size_t At(int y, int dx, int dy) const {
    return static_cast<std::size_t>((y + dy) * data_.width + area_.x0 + dx);
  }
  const float* Map(const SharedMaps& maps, int term, int dx, int dy) const {
    return &maps(term, static_cast<Eigen::Index>(At(y_, dx, dy)));
  }
  float Kernel(int kernel) const {
    return static_cast<float>(fit_.h(kernel, static_cast<Eigen::Index>(column_)));
  }
  void AddTaps(const SharedMaps& maps, float* s) const;

  const ReciprocalData& data_;
  const ReciprocalFit& fit_;
  std::size_t column_;
  int terms_;
  int du_;
  int dv_;
  PlaneArea area_;
  std::vector<TapPoint> taps_;
  int y_ = 0;
  std::vector<float> first_;   ///< ∂s/∂f_j of the first point, but for taps between
  std::vector<float> second_;  ///< of the second
  std::vector<float> scratch_;
};

}  // namespace nacre::factor::internal
