#include "rigs/transport/monte_carlo/source.h"

#include "core/error.h"
#include "core/fresnel.h"

#include <cmath>
#include <fmt/format.h>
#include <numbers>

namespace nacre::rigs::monte_carlo {
namespace {

void PlaceOnBeam(const Source& source,
                 const std::function<double()>& uniform,
                 Entry& entry) {
  entry.x_mm = source.centre.x;
  entry.y_mm = source.centre.y;
  const double width = source.width_mm;
  switch (source.shape) {
    case BeamShape::kPencil:
      break;
    case BeamShape::kSquare:
      entry.x_mm += width * (uniform() - 0.5);
      entry.y_mm += width * (uniform() - 0.5);
      break;
    case BeamShape::kDisc:
    case BeamShape::kGaussian: {
      const double u = uniform();
      // Width is a diameter, or four standard deviations.
      const double r = source.shape == BeamShape::kDisc
                           ? 0.5 * width * std::sqrt(u)
                           : 0.25 * width * std::sqrt(-2 * std::log1p(-u));
      const double angle = 2 * std::numbers::pi * uniform();
      entry.x_mm += r * std::cos(angle);
      entry.y_mm += r * std::sin(angle);
      break;
    }
  }
}

// A direction in air, as the sine of its angle: cosine-weighted over the hemisphere,
// thinned by what the surface reflects.
double DrawDiffuseSine(double eta, const std::function<double()>& uniform) {
  for (;;) {
    const double cos2 = uniform();
    if (uniform() < FresnelTransmittance(std::sqrt(cos2), eta)) {
      return std::sqrt(1 - cos2);
    }
  }
}

}  // namespace

void Validate(const Source& source) {
  if (!(source.width_mm >= 0) || !(std::abs(source.angle_rad) < std::numbers::pi / 2)) {
    throw BadData(
        fmt::format("Monte Carlo: a beam of width {} mm at {} rad; needed are a width "
                    "of at least 0 and an angle below a right one",
                    source.width_mm,
                    source.angle_rad));
  }
}

Source MakeSource(const Beam& beam, PointMm x_i) {
  return {.centre = x_i,
          .shape = beam.shape,
          .width_mm = beam.width_mm,
          .angle_rad = beam.angle_rad};
}

double SpecularReflectance(const Source& source, const Volume& volume) {
  const double eta = volume.layers.front().eta;
  return source.diffuse ? DiffuseFresnelReflectance(eta)
                        : FresnelReflectance(std::cos(source.angle_rad), eta);
}

Entry DrawEntry(const Source& source,
                const Volume& volume,
                const std::function<double()>& uniform) {
  Entry entry;
  do {  // light beside a box doesn't enter it
    PlaceOnBeam(source, uniform, entry);
  } while (volume.box && (std::abs(entry.x_mm) >= volume.box->half_x_mm ||
                          std::abs(entry.y_mm) >= volume.box->half_y_mm));
  const double eta = volume.layers.front().eta;
  if (source.diffuse) {
    const double sine = DrawDiffuseSine(eta, uniform) / eta;
    const double azimuth = 2 * std::numbers::pi * uniform();
    entry.ux = sine * std::cos(azimuth);
    entry.uy = sine * std::sin(azimuth);
  } else {
    entry.ux = std::sin(source.angle_rad) / eta;
  }
  entry.uz = std::sqrt(1 - entry.ux * entry.ux - entry.uy * entry.uy);
  return entry;
}

}  // namespace nacre::rigs::monte_carlo
