#pragma once

#include "rigs/transport/analytic/diffusion_laws.h"

#include <functional>
#include <vector>

namespace nacre::rigs {

/// A homogeneous slab as diffusion sees it.
struct RobinSlabSetup {
  DiffusionMedium medium;
  double diffusion_mm = 0;   ///< D
  double thickness_mm = 0;   ///< infinity allowed
  double top_factor = 1;     ///< A of the face the light enters
  double bottom_factor = 1;  ///< A of the other; infinity: nothing leaves
};

/// The diffusion equation in a homogeneous slab solved exactly: Robin boundaries
/// φ = 2 A D ∂φ/∂n (not extrapolated to a plane where φ = 0, as dipoles have it), and a
/// source all along the beam, σ_s' exp(−σ_t' z). Per unit flux that entered as a pencil
/// at normal incidence. It is what the finite-volume solver converges to, so that the
/// solver's error can be told from diffusion's.
///
/// Light that gets through unscattered leaves (or, where nothing may leave, is
/// reflected into a diffuse source at the bottom).
class RobinSlab {
 public:
  /// Needs σ_t' > 0, D > 0.
  explicit RobinSlab(const RobinSlabSetup& setup);

  /// Exitance of the top at distance r > 0, mm⁻². Infinite thickness: an integral over
  /// dipole-like sources; otherwise the slab's modes K₀(κ_n r) [Haberman, ch. 9].
  double Reflectance(double r_mm) const;
  /// Exitance of the bottom, scattered light only; 0 if infinitely thick.
  double Transmittance(double r_mm) const;

  /// ∫ Reflectance over the plane; in closed form.
  double TotalReflectance() const;
  /// The same of the bottom, with the unscattered light.
  double TotalTransmittance() const;

  /// The slowest lateral decay, 1/mm: exitance falls as K₀ of this times r.
  double SlowestDecayPerMm() const;

 private:
  struct Mode {
    double decay;  // κ_n
    double top;    // amplitude of K₀ in the exitances
    double bottom;
  };
  double ThickReflectance(double r_mm) const;
  double SumModes(double r_mm, double Mode::*face) const;
  void FindModes();
  struct Ends {
    double top;
    double bottom;
  };
  Ends SurfaceFluence() const;

  RobinSlabSetup setup_;
  double sigma_tr_;
  double top_extrapolation_mm_;
  double bottom_extrapolation_mm_;
  double nearest_mm_ = 0;   // from here on the modes are summed
  double near_offset_ = 0;  // what the far face adds to ThickReflectance nearer
  std::vector<Mode> modes_;
};

}  // namespace nacre::rigs
