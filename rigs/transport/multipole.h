#pragma once

#include "rigs/transport/dipole.h"

#include <vector>

namespace nacre::rigs {

/// The faces of a slab, for diffusion.
struct SlabBoundary {
  double thickness_mm = 0;  ///< finite
  double top_factor = 1;    ///< BoundaryFactor() of the face the light enters
  double bottom_factor = 1;
  /// No flux at all leaves through the bottom; `bottom_factor` is then unused.
  bool bottom_reflects_all = false;
};

/// Donner and Jensen's multipole for a slab [Donner05, sec. 3], per unit flux that
/// entered at normal incidence: the images of the source in both faces. Near the beam
/// the images are summed; from about one thickness on, where they cancel, the same
/// Green's function is summed over the slab's modes instead [Carslaw59, ch. 14], whose
/// terms fall as exp(−nπr/H). A perfectly reflecting bottom is the middle of a slab
/// twice as thick with a mirrored source.
class Multipole {
 public:
  /// Needs σ_s' > 0 and a slab thicker than one mean free path 1/σ_t', the depth of the
  /// source.
  Multipole(const DiffusionMedium& medium, const SlabBoundary& slab);

  /// R_d(r) leaving the top, mm⁻².
  double Reflectance(double r_mm) const;
  /// The same of the bottom; 0 if it reflects all.
  double Transmittance(double r_mm) const;
  /// Their integrals over the plane, in closed form.
  double TotalReflectance() const;
  double TotalTransmittance() const;

 private:
  double SumImages(double plane_mm, double r2_mm2) const;
  double SumModes(double plane_mm, double r_mm) const;
  double Flux(double plane_mm, double r_mm) const;

  double albedo_;
  double sigma_tr_;
  double thickness_mm_;
  double top_extrapolation_mm_;  // fluence is zero this far above the top
  double period_mm_;             // of the images: twice the extrapolated thickness
  std::vector<double> source_depths_mm_;
  bool transmits_;
};

}  // namespace nacre::rigs
