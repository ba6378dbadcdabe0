#pragma once

#include <array>
#include <memory>
#include <vector>

namespace nacre::render {

/// R_d(r) of a homogeneous medium for one channel: what leaves at distance r from where
/// light enters, in mm⁻².
class RadialProfile {
 public:
  virtual ~RadialProfile() = default;

  virtual double Rd(double r_mm) const = 0;

  /// What a source becomes that isn't a point but spreads with variance v along each
  /// direction of a plane, seen from well beyond √v at a distance r of which p lies in
  /// that plane: R_d + v (slope + p² bend), to second order. With p = r the bracket is
  /// ½ ∇² R_d, whose integral vanishes: the total stays.
  struct Spread {
    double slope;  ///< R_d'/r, mm⁻⁴
    double bend;   ///< (R_d'' − R_d'/r) / (2 r²), mm⁻⁶
  };
  virtual Spread SpreadTerms(double r_mm) const = 0;

  /// ∫₀^r R_d 2πs ds: what leaves within r of the beam.
  virtual double FluxWithin(double r_mm) const = 0;
  /// FluxWithin(∞).
  virtual double Total() const = 0;

  /// The length over which R_d changes near the beam.
  virtual double MeanFreePathMm() const = 0;
  /// R_d falls about like exp(−this · r) far away.
  virtual double EffectiveTransportPerMm() const = 0;

  /// R_d averaged over a disc of radius `disc_mm` whose centre is r away; of the
  /// right integral over r for any disc.
  double DiscMean(double r_mm, double disc_mm) const;
};

/// Of three channels.
using ProfileTriple = std::array<std::shared_ptr<const RadialProfile>, 3>;

/// Light of point sources in a half-space, by diffusion. With d² = r² + z², s = σ_tr d:
///   R_d(r) = Σ_k [ flux_k z_k (1 + s_k) exp(−s_k) / d_k³ + fluence_k exp(−s_k) / d_k
///   ].
class PointSourceProfile : public RadialProfile {
 public:
  struct Source {
    double depth_mm;  ///< z > 0
    double flux;      ///< weight of the flux towards the surface
    double fluence;   ///< weight of the fluence, mm⁻¹
  };
  PointSourceProfile(std::vector<Source> sources,
                     double sigma_tr_per_mm,
                     double mean_free_path_mm);

  double Rd(double r_mm) const override;
  Spread SpreadTerms(double r_mm) const override;
  double FluxWithin(double r_mm) const override;
  double Total() const override;
  double MeanFreePathMm() const override { return mean_free_path_mm_; }
  double EffectiveTransportPerMm() const override { return sigma_tr_; }

 private:
  std::vector<Source> sources_;
  double sigma_tr_;
  double mean_free_path_mm_;
};

}  // namespace nacre::render
