#pragma once

#include "core/options.h"
#include "rigs/pattern.h"

#include <vector>

namespace nacre::rigs {

/// What a lens does to a picture beside drawing it. All off by default.
struct OpticsModel {
  double vignetting = 0;        ///< loss in the corners, relative to the middle
  double vignetting_shift = 0;  ///< of its middle along x, in half widths
  double defocus_sigma_px = 0;  ///< of the Gaussian that stands for the blur
  double glare_fraction = 0;    ///< of the light that is scattered far away
  double glare_radius_px = 3;   ///< of the narrowest of the halos
  double glare_falloff = 0.5;   ///< each wider halo has 2^−falloff of the one before

  template <class Self, class Visitor>
  static void Visit(Self& self, Visitor&& visit) {
    visit("vignetting", self.vignetting, Range{0, 0.95}, "");
    visit("vignetting_shift", self.vignetting_shift, Range{-1, 1}, "");
    visit("defocus_sigma_px", self.defocus_sigma_px, Range{0, 20}, "");
    visit("glare_fraction", self.glare_fraction, Range{0, 0.9}, "");
    visit("glare_radius_px", self.glare_radius_px, Range{1, 100}, "");
    visit("glare_falloff", self.glare_falloff, Range{-2, 4}, "");
  }
};

/// Veiling glare is a sum of Gaussian halos, each twice as wide as the one before, up
/// to a quarter of the picture: density falls as r^−(2 + falloff), as it does of dusty
/// lenses. A halo is blurred at a resolution that its width allows. Beyond the picture
/// the scene is taken to be what it is along the rim, on the average.
class Optics {
 public:
  Optics(const OpticsModel& model, int width_px, int height_px, int thread_count = 0);

  /// A picture before the lens to one behind it.
  void Apply(std::vector<float>& picture) const;

  /// The share of a point's light that glare puts on a pixel so far away.
  double GlareDensity(double distance_px) const;
  /// Relative transmission at each pixel; empty if it is 1 everywhere.
  const std::vector<float>& vignetting() const { return vignetting_; }

 private:
  struct Halo {
    double sigma_px = 0;
    double weight = 0;
  };
  OpticsModel model_;
  int width_;
  int height_;
  int thread_count_;
  std::vector<float> vignetting_;
  std::vector<Halo> halos_;
};

}  // namespace nacre::rigs
