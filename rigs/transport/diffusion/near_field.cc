#include "rigs/transport/diffusion/near_field.h"

#include "rigs/transport/diffusion/local_domain.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <utility>

namespace nacre::rigs::diffusion {
namespace {

// The beam's flux by column.
std::map<std::pair<int, int>, double> ByColumn(const std::vector<BeamPoint>& beam) {
  std::map<std::pair<int, int>, double> columns;
  for (const BeamPoint& point : beam) {
    columns[{point.column_x, point.column_y}] += point.weight;
  }
  return columns;
}

}  // namespace

NearField::NearField(const ChannelSetup& setup,
                     const Request& request,
                     const std::vector<BeamPoint>& beam,
                     const std::vector<RadialProfile>& profiles)
    : half_(request.half_columns) {
  const auto columns = ByColumn(beam);
  int spread = 0;
  for (const auto& [at, weight] : columns) {
    spread = std::max({spread, std::abs(at.first), std::abs(at.second)});
  }
  const int wide = half_ + spread;
  const double step = request.step_mm;
  const int count = 2 * wide + 1;
  int margin = 0;
  const Mesh mesh =
      MakeMesh(setup,
               {.lower_left = {-(wide + 0.5) * step, -(wide + 0.5) * step},
                .step_mm = step,
                .count_x = count,
                .count_y = count},
               &margin);
  const auto column = [&](int dx, int dy) {
    return static_cast<std::size_t>(std::int64_t{dy + wide + margin} * mesh.x.Count() +
                                    dx + wide + margin);
  };
  PatternFractions fractions = SampleFractions(Pattern{}, mesh);
  for (std::size_t m = 0; m < setup.substances.size(); ++m) {
    for (auto* values : {&fractions.column, &fractions.east, &fractions.north}) {
      std::fill(values->begin(), values->end(), m == 0 ? 0.0F : 1.0F);
    }
    LocalDomain<double> domain(setup, mesh, fractions);
    domain.FromDepth(request.from_depth);
    for (const auto& [at, weight] : columns) {
      domain.AddBeam(0, column(at.first, at.second), m, weight);
    }
    domain.Solve(request.tolerance);
    // Eight-fold symmetric, so an eighth is enough.
    std::vector<double> pencil(static_cast<std::size_t>((wide + 1) * (wide + 1)));
    for (int b = 0; b <= wide; ++b) {
      for (int a = b; a <= wide; ++a) {
        const double mean = profiles[m].CellMean(a * step, b * step, step);
        pencil[static_cast<std::size_t>(std::int64_t{b} * (wide + 1) + a)] = mean;
        pencil[static_cast<std::size_t>(std::int64_t{a} * (wide + 1) + b)] = mean;
      }
    }
    std::vector<double>& logs = logs_.emplace_back();
    for (int dy = -half_; dy <= half_; ++dy) {
      for (int dx = -half_; dx <= half_; ++dx) {
        double reference = 0;
        for (const auto& [at, weight] : columns) {
          const int a = std::abs(dx - at.first);
          const int b = std::abs(dy - at.second);
          reference +=
              weight *
              pencil[static_cast<std::size_t>(std::int64_t{b} * (wide + 1) + a)];
        }
        logs.push_back(std::log(reference / domain.Exitance(0, column(dx, dy))));
      }
    }
  }
}

}  // namespace nacre::rigs::diffusion
