#pragma once

#include "calibrate/corrections.h"

#include <memory>
#include <vector>

namespace nacre::calibrate {

/// Takes scattered light back to where it came from. What is seen is
/// (1 − g) I + K ∗ I, g = Σ K, of a picture I without glare; that is solved for I by
/// one division in the Fourier domain, the picture's surroundings taken to be dark.
/// Const and safe to share between threads.
class GlareFilter {
 public:
  GlareFilter(const Glare& glare, int width_px, int height_px);
  ~GlareFilter();
  GlareFilter(GlareFilter&&) noexcept;
  GlareFilter& operator=(GlareFilter&&) noexcept;

  /// Does nothing if nothing is known of glare.
  void Remove(std::vector<float>& rates) const;
  /// K ∗ rates: what the picture would be lit with at each pixel.
  std::vector<float> Scattered(const std::vector<float>& rates) const;

 private:
  struct Spectrum;
  std::unique_ptr<Spectrum> spectrum_;  // null without glare
};

/// The same for one picture.
void RemoveGlare(const Glare& glare,
                 int width_px,
                 int height_px,
                 std::vector<float>& rates);

}  // namespace nacre::calibrate
