#pragma once

#include "factor/internal/bilinear.h"
#include "factor/material.h"

#include <vector>

namespace nacre::factor::internal {

/// A Gaussian of unit volume over the offsets of a window, mm⁻²: (β/2π) exp(−β r²/2),
/// r in mm [Song09]. Along each axis it is a factor, so that a window takes few
/// exponentials, and the same one at d and −d to the last bit.
class Gaussian {
 public:
  Gaussian(double beta_per_mm2, int radius, double pitch_mm);
  /// At an offset of u and v cells.
  double At(int u, int v) const {
    return height_ * along_[static_cast<std::size_t>(u < 0 ? -u : u)] *
           along_[static_cast<std::size_t>(v < 0 ? -v : v)];
  }

 private:
  double height_;
  std::vector<double> along_;
};

/// The Gaussians of a channel of a kProfiles material.
std::vector<Gaussian> GaussiansOf(const Material& m, int channel);

/// R'_d = √(P(x_i) P(x_o)), P = Σ_t w_t Gaussian_t, of one cell or a window. The same
/// number from either end; what lies beyond the maps is as their nearest point.
float ProfilesCell(const Material& m, int channel, GridIndex point, GridIndex cell);
void ProfilesWindow(const Material& m, int channel, GridIndex point, float* window);

}  // namespace nacre::factor::internal
