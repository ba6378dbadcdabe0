#include "rigs/transport/monte_carlo/source.h"

#include "core/error.h"
#include "core/fresnel.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numbers>

namespace nacre::rigs::monte_carlo {
namespace {

constexpr double kFarthestMm = 1e5;  // where a float still resolves 0.01 mm

PointMm Choose(const Footprint& footprint, double u) {
  const auto at =
      std::upper_bound(footprint.cumulative.begin(), footprint.cumulative.end() - 1, u);
  return footprint.centres[static_cast<std::size_t>(at - footprint.cumulative.begin())];
}

void PlaceOnBeam(const Source& source,
                 const std::function<double()>& uniform,
                 Entry& entry) {
  const PointMm centre =
      source.footprint ? Choose(*source.footprint, uniform()) : source.centre;
  entry.x_mm = centre.x;
  entry.y_mm = centre.y;
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

Footprint MakeFootprint(std::span<const PointMm> centres,
                        std::span<const double> flux) {
  Expect(centres.size() == flux.size(), "a flux for each place");
  Footprint footprint;
  double sum = 0;
  for (std::size_t k = 0; k < flux.size(); ++k) {
    if (!(flux[k] >= 0) || !std::isfinite(flux[k])) {
      throw BadData(fmt::format(
          "Monte Carlo: a flux of {} at ({:g}, {:g}) mm; light can't be negative, nor "
          "infinite",
          flux[k],
          centres[k].x,
          centres[k].y));
    }
    if (flux[k] > 0) {
      sum += flux[k];
      footprint.centres.push_back(centres[k]);
      footprint.cumulative.push_back(sum);
    }
  }
  if (!(sum > 0) || !std::isfinite(sum)) {
    throw BadData(fmt::format(
        "Monte Carlo: the flux of all places adds up to {}; there must be light, and "
        "finitely much of it",
        sum));
  }
  for (double& share : footprint.cumulative) {
    share /= sum;
  }
  return footprint;
}

void Validate(const Source& source) {
  const auto near_enough = [](double coordinate_mm) {
    return std::abs(coordinate_mm) <= kFarthestMm;  // refuses NaN too
  };
  if (!(source.width_mm >= 0) || !near_enough(source.width_mm) ||
      !(std::abs(source.angle_rad) < std::numbers::pi / 2)) {
    throw BadData(
        fmt::format("Monte Carlo: a beam of width {} mm at {} rad; needed are a width "
                    "of at least 0 and an angle below a right one",
                    source.width_mm,
                    source.angle_rad));
  }
  if (!near_enough(source.centre.x) || !near_enough(source.centre.y)) {
    throw BadData(
        fmt::format("Monte Carlo: a beam at ({:g}, {:g}) mm; positions are single "
                    "precision, so it must be within {:g} mm of the origin",
                    source.centre.x,
                    source.centre.y,
                    kFarthestMm));
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
