#pragma once

#include <vector>

namespace nacre::exchange {

/// The profile that other renderers know under the names Burley, normalized diffusion
/// or approximate reflectance profile [Christensen15, eq. 3]:
///   R(r) = A (e^(−r/d) + e^(−r/3d)) / (8π d r),  ∫ R 2πr dr = A.
/// Its share of A within radius r, x = r / d.
double BurleyShare(double x);

/// s(A) = l / d for the mean free path l in the medium, light being diffuse on entry
/// [Christensen15, eq. 6].
double BurleyScaling(double albedo);

/// How much of A falls into each of the core × core cells of a window (the share of the
/// cell, not a density), the cells being `pitch` wide; row by row.
std::vector<double> BurleyWindow(int core, double pitch, double d);

/// The single-scattering albedo of an isotropic medium with no boundary whose diffuse
/// albedo is A [Chiang16].
double SingleScatteringAlbedo(double albedo);

}  // namespace nacre::exchange
