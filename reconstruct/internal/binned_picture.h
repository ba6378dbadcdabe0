#pragma once

#include <cstddef>
#include <vector>

namespace nacre::reconstruct::internal {

/// Sums of a picture over boxes of kSide × kSide pixels, those at the right and lower
/// rim smaller.
struct BinnedPicture {
  static constexpr int kSide = 2;
  BinnedPicture(int picture_width, int picture_height)
      : width((picture_width + kSide - 1) / kSide),
        height((picture_height + kSide - 1) / kSide),
        values(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {}
  static BinnedPicture OfSize(int width, int height) {
    return {kSide * width, kSide * height};
  }
  /// Overwrites the sums with those of `picture`.
  void Fill(const std::vector<float>& picture, int picture_width);

  int width;
  int height;
  std::vector<float> values;
};

/// coarse = fine, each value shared between the two nearest bins along each axis so
/// that the light's place is kept, not only its sum; beyond the rim is the rim. A box
/// would move light by half a bin.
void Shrink(const BinnedPicture& fine, BinnedPicture& coarse);

/// fine += coarse, by the tent between the centres of its bins; constant beyond the
/// rim.
void AddGrown(const BinnedPicture& coarse, BinnedPicture& fine);

/// Dark bins around a picture before it is shrunk: light that a coarse bin has beyond
/// the rim belongs to the slope at the rim.
constexpr int kDarkRim = 2;
BinnedPicture WithRim(const BinnedPicture& picture);
/// picture += padded, less its rim.
void AddWithoutRim(const BinnedPicture& padded, BinnedPicture& picture);

/// out[x] += scale · in[x].
void AddScaled(const float* in, float scale, std::size_t count, float* out);

}  // namespace nacre::reconstruct::internal
