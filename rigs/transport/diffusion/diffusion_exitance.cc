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

// The second medium's share of the way from x_i to each column's centre.
std::vector<double> SharesAtColumns(const Pattern& pattern,
                                    const diffusion::Mesh& mesh,
                                    PointMm x_i,
                                    double step_mm) {
  std::vector<float> x;
  std::vector<float> y;
  for (int j = 0; j < mesh.y.Count(); ++j) {
    for (int i = 0; i < mesh.x.Count(); ++i) {
      x.push_back(static_cast<float>(mesh.x.Centre(i)));
      y.push_back(static_cast<float>(mesh.y.Centre(j)));
    }
  }
  const std::vector<float> share =
      diffusion::SharesOfTheWay(pattern, x_i, {x.data(), y.data(), x.size()}, step_mm);
  return {share.begin(), share.end()};
}

// A pencil is one point, whatever the four that stand for it.
std::vector<BeamPoint> PointsOf(const Beam& beam, const std::vector<BeamPoint>& all) {
  return beam.shape == BeamShape::kPencil ? std::vector<BeamPoint>{{{}, 1, 0, 0}} : all;
}

}  // namespace

// log of the exitance over that of homogeneous slabs on the same mesh, media weighted
// by the segment's share of each: what a mesh makes of the beam cancels.
std::vector<double> DiffusionTransport::Impl::LogRatio(
    const Channel& channel,
    const Scene& scene,
    const diffusion::Neighbourhood& place,
    PointMm x_i) const {
  constexpr double kDarkest = 1e-300;
  LocalDomain<double> mixed(channel.setup, scene.mesh, scene.fractions);
  mixed.FromDepth(FromDepth());
  AddBeam(channel, scene, place, x_i, 0, mixed);
  mixed.Solve(options.tolerance);
  const std::vector<double> share =
      SharesAtColumns(phantom.pattern, scene.mesh, x_i, channel.step_mm);
  std::vector<double> logs;
  for (std::size_t c = 0; c < share.size(); ++c) {
    logs.push_back(std::log(std::max(mixed.Exitance(0, c), kDarkest)));
  }
  const auto centre =
      static_cast<std::ptrdiff_t>(CentreColumn(channel, scene, place, x_i));
  PatternFractions same = scene.fractions;
  for (std::size_t m = 0; m < channel.setup.substances.size(); ++m) {
    for (auto* values : {&same.column, &same.east, &same.north}) {
      std::fill(values->begin(), values->end(), m == 0 ? 0.0F : 1.0F);
    }
    LocalDomain<double> pure(channel.setup, scene.mesh, same);
    pure.FromDepth(FromDepth());
    for (const BeamPoint& point : PointsOf(phantom.beam, channel.beam)) {
      pure.AddBeam(
          0,
          static_cast<std::size_t>(centre + std::ptrdiff_t{point.column_y} * scene.nx +
                                   point.column_x),
          m,
          point.weight);
    }
    pure.Solve(options.tolerance);
    for (std::size_t c = 0; c < share.size(); ++c) {
      logs[c] -= (m == 0 ? 1 - share[c] : share[c]) *
                 std::log(std::max(pure.Exitance(0, c), kDarkest));
    }
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
  const std::vector<double> logs = impl_->LogRatio(channel, scene, place, x_i);
  const std::vector<BeamPoint> beam = PointsOf(impl_->phantom.beam, channel.beam);
  const std::vector<float> share =
      diffusion::SharesOfTheWay(impl_->phantom.pattern, x_i, points, channel.step_mm);
  const auto nx = static_cast<std::size_t>(scene.nx);
  const auto alone = [&](std::size_t medium, double x, double y) {
    double sum = 0;
    for (const BeamPoint& point : beam) {
      sum += point.weight *
             channel.profiles[medium].Value(std::hypot(x - x_i.x - point.offset_mm.x,
                                                       y - x_i.y - point.offset_mm.y));
    }
    return std::log(sum);
  };
  for (std::size_t k = 0; k < points.count; ++k) {
    const double x = static_cast<double>(points.x_mm[k]);
    const double y = static_cast<double>(points.y_mm[k]);
    const Between u = Locate(scene.mesh.x, x);
    const Between v = Locate(scene.mesh.y, y);
    const double* low = &logs[v.low * nx + u.low];
    const double* high = low + nx;
    const double log_ratio = std::lerp(
        std::lerp(low[0], low[1], u.part), std::lerp(high[0], high[1], u.part), v.part);
    const double log_alone = std::lerp(alone(0, x, y),
                                       alone(channel.profiles.size() - 1, x, y),
                                       static_cast<double>(share[k]));
    exitance[k] += static_cast<float>(flux * std::exp(log_alone + log_ratio));
  }
}

}  // namespace nacre::rigs
