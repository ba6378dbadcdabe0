#pragma once

#include "calibrate/corrections.h"
#include "reconstruct/internal/binned_picture.h"

#include <vector>

namespace nacre::reconstruct::internal {

/// Glare on a picture, to be taken away: (1 − g) I + K ∗ I = seen (calibrate/glare.h)
/// is solved by I = seen / (1 − g) − C ∗ seen. C is smooth but for its hole, so that a
/// sum of Gaussians, two an octave, stands for it; each is convolved along rows and
/// columns of a picture binned to its width. That takes a few operations a pixel. Const
/// and safe to share between threads.
class GlarePyramid {
 public:
  /// Of the light scattered into a cell, relative: how far this is from the Fourier
  /// solution (a test).
  static constexpr double kError = 0.05;

  GlarePyramid(const calibrate::Glare& glare, int width_px, int height_px);

  bool empty() const { return gaussians_.empty(); }
  double fraction() const { return fraction_; }  ///< g
  /// C ∗ picture, of sums over boxes; the mean of each box comes out.
  BinnedPicture Scattered(BinnedPicture sums) const;

 private:
  struct Gaussian {
    double sigma_px;  ///< with all that binning and interpolating add
    double weight;
    std::vector<float> taps;  ///< at its level, weight and a pixel's share in them
    int level;
  };
  void FitWeights(const calibrate::Glare& glare, double reach_px);
  void Convolve(int level, const BinnedPicture& sums, BinnedPicture& result) const;

  double fraction_ = 0;
  int level_count_ = 0;
  std::vector<Gaussian> gaussians_;  // from narrow to wide
};

}  // namespace nacre::reconstruct::internal
