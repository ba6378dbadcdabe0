#pragma once

namespace nacre::rigs {

/// A = (1 + F_dr) / (1 − F_dr), how much farther than the surface the fluence
/// extrapolates to zero because of internal reflection [Jensen01, sec. 2.3]. F_dr is
/// integrated exactly. `eta` ≥ 1, inside over outside; 1 for a matched boundary.
double BoundaryFactor(double eta);

/// What of a medium diffusion sees.
struct DiffusionMedium {
  double sigma_a_per_mm = 0;
  double sigma_s_prime_per_mm = 0;

  double SigmaTPrime() const { return sigma_a_per_mm + sigma_s_prime_per_mm; }
  double ReducedAlbedo() const { return sigma_s_prime_per_mm / SigmaTPrime(); }
  /// Effective transport coefficient, √(3 σ_a σ_t').
  double SigmaTr() const;
  /// D = 1 / (3 σ_t').
  double DiffusionMm() const { return 1 / (3 * SigmaTPrime()); }
};

/// Radiant exitance at distance r of one real and one virtual source below and above a
/// plane, per unit of source: the kernel of both models,
///   z (1 + σ_tr d) exp(−σ_tr d) / (4π d³), d² = r² + z².
double SourceExitance(double z_mm, double r2_mm2, double sigma_tr_per_mm);

/// The classic dipole for a semi-infinite medium [Jensen01, eq. 4], per unit flux that
/// entered at normal incidence.
class Dipole {
 public:
  /// Needs σ_s' > 0.
  Dipole(const DiffusionMedium& medium, double boundary_factor);

  /// R_d(r), mm⁻².
  double Reflectance(double r_mm) const;
  /// ∫ R_d over the plane, in closed form.
  double TotalReflectance() const;

 private:
  double albedo_;
  double sigma_tr_;
  double real_depth_mm_;
  double virtual_height_mm_;
};

}  // namespace nacre::rigs
