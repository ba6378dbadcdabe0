#include "rigs/transport/diffusion/pattern_field.h"

#include <array>
#include <cmath>
#include <cstddef>

namespace nacre::rigs::diffusion {
namespace {

constexpr int kLines = PatternFractions::kLines;
constexpr auto kLinesSize = static_cast<std::size_t>(kLines);

double LinePosition(const Axis& axis, int i, int line) {
  return axis.Low(i) + axis.Width(i) * (line + 0.5) / kLines;
}

// Mean over the lines of the harmonic mean of D along each.
double Between(const float* fractions, double first_mm, double second_mm) {
  double sum = 0;
  for (int line = 0; line < kLines; ++line) {
    const double f = static_cast<double>(fractions[line]);
    sum += 1 / ((1 - f) / first_mm + f / second_mm);
  }
  return sum / kLines;
}

}  // namespace

std::vector<float> SharesOfTheWay(const Pattern& pattern,
                                  PointMm beam,
                                  const PointColumns& points,
                                  double step_mm) {
  const double aside_mm = 1e-3 * step_mm;
  std::vector<float> mean(points.count);
  std::vector<float> one(points.count);
  for (const double sy : {-aside_mm, aside_mm}) {
    for (const double sx : {-aside_mm, aside_mm}) {
      pattern.SecondMediumFraction({beam.x + sx, beam.y + sy}, points, one.data());
      for (std::size_t k = 0; k < mean.size(); ++k) {
        mean[k] += 0.25F * one[k];
      }
    }
  }
  return mean;
}

PatternFractions SampleFractions(const Pattern& pattern, const Mesh& mesh) {
  const auto nx = static_cast<std::size_t>(mesh.x.Count());
  const auto ny = static_cast<std::size_t>(mesh.y.Count());
  PatternFractions f;
  f.mixed = pattern.type == PatternType::kMixture;
  f.column.resize(nx * ny);
  f.east.resize(nx * ny * kLinesSize);
  f.north.resize(nx * ny * kLinesSize);
  if (pattern.MediumCount() == 1) {
    return f;
  }
  std::size_t c = 0;
  for (int j = 0; j < mesh.y.Count(); ++j) {
    for (int i = 0; i < mesh.x.Count(); ++i, ++c) {
      double mean = 0;
      for (int line = 0; line < kLines; ++line) {
        const double y = LinePosition(mesh.y, j, line);
        const double x = LinePosition(mesh.x, i, line);
        const std::size_t at = c * kLinesSize + static_cast<std::size_t>(line);
        mean += pattern.SecondMediumFraction({mesh.x.Low(i), y}, {mesh.x.High(i), y});
        if (i + 1 < mesh.x.Count()) {
          f.east[at] = static_cast<float>(pattern.SecondMediumFraction(
              {mesh.x.Centre(i), y}, {mesh.x.Centre(i + 1), y}));
        }
        if (j + 1 < mesh.y.Count()) {
          f.north[at] = static_cast<float>(pattern.SecondMediumFraction(
              {x, mesh.y.Centre(j)}, {x, mesh.y.Centre(j + 1)}));
        }
      }
      f.column[c] = static_cast<float>(mean / kLines);
    }
  }
  return f;
}

LateralField MakeField(const PatternFractions& fractions, const ChannelSetup& setup) {
  const ChannelSetup::Substance& first = setup.substances.front();
  const ChannelSetup::Substance& second = setup.substances.back();
  LateralField field;
  for (std::size_t c = 0; c < fractions.column.size(); ++c) {
    const double f = static_cast<double>(fractions.column[c]);
    field.sigma_a_per_mm.push_back(
        std::lerp(first.medium.sigma_a_per_mm, second.medium.sigma_a_per_mm, f));
    field.diffusion_mm.push_back(
        fractions.mixed
            ? 1 / std::lerp(1 / first.diffusion_mm, 1 / second.diffusion_mm, f)
            : std::lerp(first.diffusion_mm, second.diffusion_mm, f));
    field.side_decay_per_mm.push_back(
        std::lerp(first.decay_per_mm, second.decay_per_mm, f));
    field.east_diffusion_mm.push_back(Between(
        &fractions.east[c * kLinesSize], first.diffusion_mm, second.diffusion_mm));
    field.north_diffusion_mm.push_back(Between(
        &fractions.north[c * kLinesSize], first.diffusion_mm, second.diffusion_mm));
  }
  return field;
}

}  // namespace nacre::rigs::diffusion
