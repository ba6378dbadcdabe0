#include "rigs/pattern.h"
#include "rigs/transport/diffusion/internal/diffusion_state.h"

#include <algorithm>
#include <cmath>

namespace nacre::rigs {
namespace {

using diffusion::Axis;
using diffusion::BeamPoint;
using diffusion::LocalDomain;
using diffusion::PatternFractions;

// Where a coordinate lies between the centres of two neighbouring columns.
struct Between {
  std::size_t low = 0;
  double part = 0;
};

Between Locate(const Axis& axis, double at_mm) {
  const auto above =
      std::upper_bound(axis.edges_mm.begin(), axis.edges_mm.end(), at_mm);
  int i = std::clamp(
      static_cast<int>(above - axis.edges_mm.begin()) - 1, 0, axis.Count() - 1);
  i = std::clamp(at_mm < axis.Centre(i) ? i - 1 : i, 0, axis.Count() - 2);
  const double part = (at_mm - axis.Centre(i)) / (axis.Centre(i + 1) - axis.Centre(i));
  return {static_cast<std::size_t>(i), std::clamp(part, 0.0, 1.0)};
}

// A pencil is one point, whatever the four that stand for it.
std::vector<BeamPoint> PointsOf(const Beam& beam, const std::vector<BeamPoint>& all) {
  return beam.shape == BeamShape::kPencil ? std::vector<BeamPoint>{{{}, 1, 0, 0}} : all;
}

}  // namespace

// log of the exitance over that of a slab of the beam's own medium, column by column on
// the same mesh: smooth, since what a mesh makes of the beam cancels.
std::vector<double> DiffusionTransport::Impl::LogRatio(
    const Channel& channel,
    const Scene& scene,
    const diffusion::Neighbourhood& place,
    PointMm x_i,
    std::size_t home) const {
  PatternFractions same = scene.fractions;
  const bool second = home > 0;
  for (auto* values : {&same.column, &same.east, &same.north}) {
    std::fill(values->begin(), values->end(), second ? 1.0F : 0.0F);
  }
  LocalDomain<double> mixed(channel.setup, scene.mesh, scene.fractions);
  LocalDomain<double> pure(channel.setup, scene.mesh, same);
  if (options.reciprocal_exit) {
    mixed.UseReciprocalExit();
    pure.UseReciprocalExit();
  }
  AddBeam(channel, scene, place, x_i, 0, mixed);
  const auto centre =
      static_cast<std::ptrdiff_t>(CentreColumn(channel, scene, place, x_i));
  for (const BeamPoint& point : PointsOf(phantom.beam, channel.beam)) {
    pure.AddBeam(
        0,
        static_cast<std::size_t>(centre + std::ptrdiff_t{point.column_y} * scene.nx +
                                 point.column_x),
        home,
        point.weight);
  }
  mixed.Solve(options.tolerance);
  pure.Solve(options.tolerance);
  constexpr double kDarkest = 1e-300;
  std::vector<double> logs(scene.fractions.column.size());
  for (std::size_t c = 0; c < logs.size(); ++c) {
    logs[c] = std::log(std::max(mixed.Exitance(0, c), kDarkest) /
                       std::max(pure.Exitance(0, c), kDarkest));
  }
  return logs;
}

void DiffusionTransport::AddExitance(PointMm x_i,
                                     std::size_t channel_index,
                                     double flux,
                                     const PointColumns& points,
                                     float* exitance) const {
  const Channel& channel = impl_->channels[channel_index];
  const diffusion::Neighbourhood place = diffusion::AloneAt(x_i);
  const Impl::Scene scene = impl_->MakeScene(channel, place);
  const auto home = static_cast<std::size_t>(impl_->phantom.pattern.MediumAt(x_i));
  const std::vector<double> logs = impl_->LogRatio(channel, scene, place, x_i, home);
  const std::vector<BeamPoint> beam = PointsOf(impl_->phantom.beam, channel.beam);
  const auto nx = static_cast<std::size_t>(scene.nx);
  for (std::size_t k = 0; k < points.count; ++k) {
    const double x = static_cast<double>(points.x_mm[k]);
    const double y = static_cast<double>(points.y_mm[k]);
    const Between u = Locate(scene.mesh.x, x);
    const Between v = Locate(scene.mesh.y, y);
    const double* low = &logs[v.low * nx + u.low];
    const double* high = low + nx;
    const double log_ratio = std::lerp(
        std::lerp(low[0], low[1], u.part), std::lerp(high[0], high[1], u.part), v.part);
    double alone = 0;
    for (const BeamPoint& point : beam) {
      alone += point.weight *
               channel.profiles[home].Value(std::hypot(x - x_i.x - point.offset_mm.x,
                                                       y - x_i.y - point.offset_mm.y));
    }
    exitance[k] += static_cast<float>(flux * alone * std::exp(log_ratio));
  }
}

}  // namespace nacre::rigs
