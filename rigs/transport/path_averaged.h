#pragma once

#include "rigs/transport/beam_nodes.h"
#include "rigs/transport/cell_quadrature.h"
#include "rigs/transport/radial_table.h"
#include "rigs/transport/transport.h"

#include <vector>

namespace nacre::rigs {

/// The fast model: R_d(x_i, x_o) is that of a homogeneous slab, at distance |x_o −
/// x_i|, whose σ_a and σ_s' are the means along the straight segment from x_i to x_o.
/// For one medium it is Donner and Jensen's multipole (the dipole if the slab is
/// infinitely thick); for any it is positive and reciprocal. It knows nothing of light
/// that goes round an obstacle, of the beam's first scatterings, or of the beam's
/// angle.
///
/// Bottoms: air reflects as the top does; matched and black reflect nothing (A = 1) and
/// differ in where the light is counted; white lets nothing through.
class PathAveraged final : public Transport {
 public:
  /// Tabulates the model. Throws BadData for what diffusion can't do: a medium without
  /// scattering, a slab thinner than a mean free path, an oblique beam.
  explicit PathAveraged(const Phantom& phantom,
                        int thread_count = 0,
                        const Ranks* ranks = nullptr);

  const Phantom& phantom() const override { return phantom_; }
  Window WindowAround(PointMm x_i) const override;
  void AddExitance(PointMm x_i,
                   std::size_t channel,
                   double flux,
                   const PointColumns& points,
                   float* exitance) const override;
  double ReachMm(std::size_t channel) const override { return reach_mm_[channel]; }
  Totals TotalsAt(PointMm x_i, std::size_t channel) const override;

  /// The model at one pair of points for a pencil beam, without tables: mm⁻².
  double Direct(PointMm x_i, PointMm x_o, std::size_t channel) const;

 private:
  void AddChannels(PointMm x_i,
                   std::size_t first,
                   std::size_t last,
                   double flux,
                   const PointColumns& points,
                   float* exitance) const;
  std::vector<std::size_t> CellsOfSeveralMedia(PointMm x_i) const;

  Phantom phantom_;
  std::vector<BeamNode> beam_;       // what of the beam isn't in the tables
  std::vector<RadialTable> tables_;  // one a channel
  std::vector<double> reach_mm_;
  CellQuadrature quadrature_;
};

}  // namespace nacre::rigs
