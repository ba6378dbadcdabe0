#pragma once

#include "reconstruct/internal/spot_rings.h"

#include <vector>

namespace nacre::reconstruct::internal {

/// What was seen around spots in one laser channel.
struct SpotsOfChannel {
  SpotRings reference;           ///< on a diffuse target of reflectance 1
  std::vector<SpotRings> spots;  ///< on the sample, for the same flux; none is empty
};

/// A number and its standard uncertainty.
struct Estimate {
  double value = 0;
  double sigma = 0;
};

/// A channel: how much light the surface itself throws back, like a diffuse target of
/// that reflectance; may come out negative where there is none. Spots are told apart by
/// how bright they are a pixel or more away. The mean profile of each such class is
///   s G(r) + Σ_m w_m D_m(r) + background,   w ≥ 0,
/// G on the reference, D_m a dipole [Jensen01] of any strength, depth z and
/// attenuation (q = σ_tr z), blurred by G. Light from less than `least_depth` widths of
/// the spot can't be told from gloss and counts as such. Classes and then channels are
/// brought together as random effects [DerSimonian86]: reflection at a surface isn't
/// coloured, so that channels that agree are averaged, and one that doesn't keeps its
/// own. `eta`: index of the sample.
std::vector<Estimate> FitGloss(const std::vector<SpotsOfChannel>& channels,
                               double eta,
                               double least_depth = 1.35);

/// Estimates of one thing that differ by noise and, from one to another, by τ: their
/// mean. `tau2_least`: what τ² is at least. τ² is returned too.
struct Pooled {
  Estimate mean = {};
  double tau2 = 0;
};
Pooled Pool(const std::vector<Estimate>& estimates, double tau2_least = 0);

}  // namespace nacre::reconstruct::internal
