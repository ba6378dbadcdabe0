#pragma once

#include "factor/internal/reciprocal_fit.h"
#include "factor/internal/reciprocal_taps.h"
#include "factor/internal/row_streams.h"

#include <cstdint>
#include <vector>

namespace nacre::factor::internal {

/// What rows of pairs are worked on in: one a thread.
struct RowScratch {
  std::vector<float> first;   ///< ∂s/∂f_j of the first point, but for taps between
  std::vector<float> second;  ///< of the second
  std::vector<const float*> a;
  std::vector<const float*> b;
  std::vector<Sink> sinks;
};

/// One row of pairs at an offset, in a channel: what maps and kernels add up to, its
/// derivatives, and sums of them back into maps. Arrays run over x from area.x0.
class ReciprocalRows {
 public:
  ReciprocalRows(const ReciprocalData& data,
                 const ReciprocalFit& fit,
                 std::size_t channel,
                 std::size_t cell,
                 RowScratch& scratch);

  const PlaneArea& area() const { return area_; }
  std::size_t Points() const { return static_cast<std::size_t>(area_.x1 - area_.x0); }

  /// To be called first for a row y of the first points. Others with the same scratch
  /// have to look again after it.
  void Look(int y);
  /// The logarithm of R_d over the peak.
  void Model(float* s) const;
  /// Its change along a change of the maps.
  void Along(const SharedMaps& change, float* s) const;
  /// Adds what a change of s by `r` means to the maps.
  void Back(const float* r, SharedMaps& gradient) const;
  /// Adds to each point's block of the normal equations, rows (j, k ≤ j), at weights w.
  void Blocks(const float* w, SharedMaps& blocks);

 private:
  std::size_t At(int y, int dx, int dy) const {
    return static_cast<std::size_t>(std::int64_t{y + dy} * width_ + area_.x0 + dx);
  }
  const float* Map(const SharedMaps& maps, int term, int dx, int dy) const {
    return &maps(term, static_cast<Eigen::Index>(At(y_, dx, dy)));
  }
  float Kernel(int kernel) const { return kernels_[static_cast<std::size_t>(kernel)]; }
  float* First(int j) const {
    return &scratch_.first[static_cast<std::size_t>(j) * Points()];
  }
  float* Second(int j) const {
    return &scratch_.second[static_cast<std::size_t>(j) * Points()];
  }
  void ListTaps(const SharedMaps& maps) const;
  void AddBlock(
      const float* w, const float* v, int dx, int dy, SharedMaps& blocks) const;

  const SharedMaps& maps_;
  RowScratch& scratch_;
  int width_;
  int terms_;
  int du_;
  int dv_;
  PlaneArea area_;
  std::vector<TapPoint> taps_;
  std::vector<float> kernels_;
  std::vector<float> pairs_;        ///< [j][k]: ∂²s/∂f_j ∂f_k
  std::vector<float> end_weights_;  ///< of a term's map at the second point
  std::vector<float> tap_weights_;  ///< [tap point][term]
  int y_ = 0;
};

}  // namespace nacre::factor::internal
