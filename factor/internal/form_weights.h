#pragma once

#include "factor/material.h"

#include <vector>

namespace nacre::factor::internal {

/// How much a unit of each map of a kTucker material changes R_d: the norm over a
/// window, rms over some of its points. The shift map has 0.
std::vector<double> TuckerMapWeights(const Material& m);

/// dR_d / dI, rms over the same points, all channels and cells together.
double TuckerGain(const Material& m);

/// The same of a kProfiles material's maps: the norms of its Gaussians.
std::vector<double> ProfilesMapWeights(const Material& m);

}  // namespace nacre::factor::internal
