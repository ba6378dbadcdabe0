#pragma once

#include "rigs/phantom.h"
#include "rigs/transport/monte_carlo/volume.h"

#include <functional>
#include <memory>
#include <span>
#include <vector>

namespace nacre::rigs::monte_carlo {

/// Many places that light enters around, each with its share of the flux.
struct Footprint {
  std::vector<PointMm> centres;
  std::vector<double> cumulative;  ///< shares of the first, the first two, … centres
};

/// Leaves out places without flux. Throws BadData if a flux is negative or not finite,
/// or if there is none.
Footprint MakeFootprint(std::span<const PointMm> centres, std::span<const double> flux);

/// Light that arrives on the top surface.
struct Source {
  PointMm centre{};  ///< x_i
  BeamShape shape = BeamShape::kPencil;
  double width_mm = 0;   ///< as Beam::width_mm, measured on the surface
  double angle_rad = 0;  ///< in air, from the normal, towards +x
  bool diffuse = false;  ///< Lambertian: radiance the same from all directions
  /// Beams of that shape around all these places instead of `centre`.
  std::shared_ptr<const Footprint> footprint{};
};

/// Throws BadData for what can't be lit.
void Validate(const Source& source);

Source MakeSource(const Beam& beam, PointMm x_i);

/// The part of the arriving flux that the first surface reflects; the rest enters.
double SpecularReflectance(const Source& source, const Volume& volume);

/// A photon just inside the top surface. uz > 0 is downwards.
struct Entry {
  double x_mm = 0;
  double y_mm = 0;
  double ux = 0;
  double uy = 0;
  double uz = 1;
};

/// Draws from the distribution of light that entered. `uniform` gives numbers in
/// [0, 1).
Entry DrawEntry(const Source& source,
                const Volume& volume,
                const std::function<double()>& uniform);

}  // namespace nacre::rigs::monte_carlo
