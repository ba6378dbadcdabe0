#pragma once

namespace nacre::render {

/// The diffuse reflectance profile of a semi-infinite homogeneous medium by the dipole
/// of Jensen et al. 2001, for one channel. With D = 1/(3 σ_t'), z_r = 1/σ_t',
/// A = (1 + F_dr)/(1 − F_dr), z_v = z_r (1 + 4A/3), σ_tr = √(3 σ_a σ_t') and
/// d_k² = r² + z_k²:
///   R_d(r) = α'/(4π) Σ_{k ∈ {r, v}} z_k (1 + σ_tr d_k) exp(−σ_tr d_k) / d_k³.
class DipoleProfile {
 public:
  /// Coefficients in mm⁻¹, F_dr the diffuse reflectance of the surface from inside.
  /// Throws a usage Error for values that are negative or not finite, for both
  /// coefficients zero, or F_dr outside [0, 1).
  DipoleProfile(double sigma_a_per_mm,
                double sigma_s_prime_per_mm,
                double internal_reflectance);

  /// R_d in mm⁻² at distance r.
  double Rd(double r_mm) const;

  /// What a source becomes that isn't a point but spreads with variance v along each
  /// direction of a plane, seen from well beyond √v at a distance r of which p lies in
  /// that plane: R_d + v (slope + p² bend), to second order. With p = r the bracket is
  /// ½ ∇² R_d, whose integral vanishes: the total stays.
  struct Spread {
    double slope;  ///< R_d'/r, mm⁻⁴
    double bend;   ///< (R_d'' − R_d'/r) / (2 r²), mm⁻⁶
  };
  Spread SpreadTerms(double r_mm) const;

  /// ∫₀^r R_d 2πs ds: what leaves within r of the beam.
  double FluxWithin(double r_mm) const;

  /// FluxWithin(∞).
  double Total() const;

  /// R_d averaged over a disc of radius `disc_mm` whose centre is r away; of the
  /// right integral over r for any disc.
  double DiscMean(double r_mm, double disc_mm) const;

  /// 1/σ_t'.
  double MeanFreePathMm() const { return z_real_; }
  double EffectiveTransportPerMm() const { return sigma_tr_; }

 private:
  double albedo_;
  double sigma_tr_;
  double z_real_;
  double z_virtual_;
};

}  // namespace nacre::render
