#include "rigs/transport/diffusion/diffusion_transport.h"

#include "core/error.h"
#include "rigs/pattern_mixture.h"
#include "rigs/transport/diffusion/internal/diffusion_state.h"
#include "rigs/transport/diffusion/monte_carlo_profile.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <utility>
#include <vector>

namespace nacre::rigs {

using diffusion::BeamPoint;
using diffusion::ChannelSetup;
using diffusion::LocalDomain;
using diffusion::NearField;
using diffusion::Neighbourhood;

namespace {

// The smallest odd number that is not less.
int OddAtLeast(double value) {
  const int whole = std::max(1, static_cast<int>(std::ceil(value - 1e-9)));
  return whole % 2 == 1 ? whole : whole + 1;
}

double ShortestFreePathMm(const Phantom& phantom, std::size_t channel) {
  double shortest = std::numeric_limits<double>::infinity();
  for (const Medium& medium : diffusion::PatternMedia(phantom)) {
    shortest = std::min(
        shortest,
        1 / (medium.sigma_a_per_mm[channel] + medium.ReducedScattering(channel)));
  }
  return shortest;
}

}  // namespace

DiffusionTransport::Channel DiffusionTransport::Impl::MakeChannel(
    std::size_t c, const ReferenceProfile& reference) const {
  const double half_window_mm = 0.5 * core * pitch_mm;
  Channel channel;
  channel.setup = diffusion::MakeChannelSetup(phantom, c, options, half_window_mm);
  const ChannelSetup& setup = channel.setup;
  channel.refine =
      OddAtLeast(pitch_mm / (options.step_free_paths * setup.shortest_free_path_mm));
  channel.step_mm = pitch_mm / channel.refine;
  channel.beam = diffusion::BeamFootprint(phantom.beam, channel.step_mm);
  const double last_mm =
      2 * (half_window_mm + setup.margin_mm + 10 * setup.shortest_free_path_mm);
  for (std::size_t m = 0; m < setup.substances.size(); ++m) {
    std::function<double(double)> profile;
    if (reference) {
      profile = [&](double r_mm) { return reference(m, c, r_mm); };
    } else if (options.reference_photons > 0) {
      profile = diffusion::MonteCarloProfile(phantom,
                                             {.medium = m,
                                              .channel = c,
                                              .last_mm = last_mm,
                                              .photon_count = options.reference_photons,
                                              .seed = options.reference_seed,
                                              .thread_count = options.thread_count,
                                              .ranks = options.ranks},
                                             RobinSlab(setup.substances[m].slab));
    } else {
      profile = [exact = RobinSlab(setup.substances[m].slab)](double r_mm) {
        return exact.Reflectance(r_mm);
      };
    }
    channel.profiles.emplace_back(
        profile, 1e-4 * setup.shortest_free_path_mm, last_mm, options.thread_count);
    channel.reach_mm =
        std::max(channel.reach_mm,
                 channel.profiles.back().Reach(1e-4) + 0.5 * phantom.beam.width_mm);
  }
  channel.near_field = std::make_unique<NearField>(
      setup,
      NearField::Request{.step_mm = channel.step_mm,
                         .half_columns = (core * channel.refine - 1) / 2,
                         .from_depth = FromDepth(),
                         .tolerance = std::min(options.tolerance, 1e-8)},
      channel.beam,
      channel.profiles);
  return channel;
}

DiffusionTransport::DiffusionTransport(const Phantom& phantom,
                                       const DiffusionOptions& options,
                                       const ReferenceProfile& reference)
    : Transport(options.thread_count, options.ranks) {
  Validate(options);
  RequirePlanePattern(phantom, "the diffusion solver");
  if (phantom.beam.angle_rad != 0) {
    throw BadData(
        "the diffusion solver can't do beam.angle_deg other than 0; use Monte Carlo");
  }
  auto impl = std::make_unique<Impl>();
  impl->phantom = phantom;
  impl->options = options;
  const std::size_t channel_count = phantom.channels.size();
  if (phantom.grid.points_x > 0) {
    impl->pitch_mm = phantom.grid.pitch_mm;
    impl->core = phantom.grid.core;
  } else {
    constexpr int kColumnsWithoutGrid = 21;
    double shortest_mm = std::numeric_limits<double>::infinity();
    for (std::size_t c = 0; c < channel_count; ++c) {
      shortest_mm = std::min(shortest_mm, ShortestFreePathMm(phantom, c));
    }
    // Nothing attenuates: MakeChannel() says so.
    impl->pitch_mm =
        std::isinf(shortest_mm) ? 1 : options.step_free_paths * shortest_mm;
    impl->core = kColumnsWithoutGrid;
  }
  for (std::size_t c = 0; c < channel_count; ++c) {
    impl->channels.push_back(impl->MakeChannel(c, reference));
  }
  impl_ = std::move(impl);
}

DiffusionTransport::~DiffusionTransport() = default;

const Phantom& DiffusionTransport::phantom() const {
  return impl_->phantom;
}

double DiffusionTransport::ReachMm(std::size_t channel) const {
  return impl_->channels[channel].reach_mm;
}

DiffusionTransport::Impl::Scene DiffusionTransport::Impl::MakeScene(
    const Channel& channel, const Neighbourhood& place) const {
  Scene scene;
  const double half_window_mm = 0.5 * core * pitch_mm;
  scene.mesh = diffusion::MakeMesh(
      channel.setup,
      {.lower_left = {place.first.x - half_window_mm, place.first.y - half_window_mm},
       .step_mm = channel.step_mm,
       .count_x = (core + place.columns - 1) * channel.refine,
       .count_y = (core + place.rows - 1) * channel.refine},
      &scene.margin);
  scene.nx = scene.mesh.x.Count();
  scene.fractions = diffusion::SampleFractions(phantom.pattern, scene.mesh);
  return scene;
}

// The column the beam's centre is in.
std::size_t DiffusionTransport::Impl::CentreColumn(const Channel& channel,
                                                   const Scene& scene,
                                                   const Neighbourhood& place,
                                                   PointMm x_i) const {
  const auto cells = [&](double offset_mm) {
    const int from_first = static_cast<int>(std::lround(offset_mm / pitch_mm));
    return from_first * channel.refine + (core * channel.refine - 1) / 2 + scene.margin;
  };
  return static_cast<std::size_t>(std::int64_t{cells(x_i.y - place.first.y)} *
                                      scene.nx +
                                  cells(x_i.x - place.first.x));
}

template <class Real>
void DiffusionTransport::Impl::AddBeam(const Channel& channel,
                                       const Scene& scene,
                                       const Neighbourhood& place,
                                       PointMm x_i,
                                       std::size_t lane,
                                       LocalDomain<Real>& domain) const {
  const auto centre =
      static_cast<std::ptrdiff_t>(CentreColumn(channel, scene, place, x_i));
  std::map<std::size_t, std::array<double, 2>> flux;  // by column and medium
  for (const BeamPoint& point : channel.beam) {
    const PointMm at{x_i.x + point.offset_mm.x, x_i.y + point.offset_mm.y};
    const double second = phantom.pattern.type == PatternType::kMixture
                              ? phantom.pattern.mixture->At(at)
                              : phantom.pattern.MediumAt(at);
    auto& [in_first, in_second] = flux[static_cast<std::size_t>(
        centre + std::ptrdiff_t{point.column_y} * scene.nx + point.column_x)];
    in_first += point.weight * (1 - second);
    in_second += point.weight * second;
  }
  for (const auto& [column, parts] : flux) {
    for (std::size_t medium = 0; medium < parts.size(); ++medium) {
      if (parts[medium] > 0) {
        domain.AddBeam(lane, column, medium, parts[medium]);
      }
    }
  }
}

// The other file needs both.
template void DiffusionTransport::Impl::AddBeam(const Channel&,
                                                const Scene&,
                                                const Neighbourhood&,
                                                PointMm,
                                                std::size_t,
                                                LocalDomain<float>&) const;
template void DiffusionTransport::Impl::AddBeam(const Channel&,
                                                const Scene&,
                                                const Neighbourhood&,
                                                PointMm,
                                                std::size_t,
                                                LocalDomain<double>&) const;

void DiffusionTransport::Impl::ReadWindow(
    const Channel& channel,
    const Scene& scene,
    const Neighbourhood& place,
    PointMm x_i,
    const std::function<double(std::size_t column)>& exitance,
    float* rd) const {
  const std::size_t centre = CentreColumn(channel, scene, place, x_i);
  const int half = (core - 1) / 2;
  const int sub = (channel.refine - 1) / 2;
  const auto cells = static_cast<std::size_t>(core) * static_cast<std::size_t>(core);
  std::vector<float> x;
  std::vector<float> y;
  for (int row = 0; row < core; ++row) {
    for (int col = 0; col < core; ++col) {
      x.push_back(static_cast<float>(x_i.x + (col - half) * pitch_mm));
      y.push_back(static_cast<float>(x_i.y + (half - row) * pitch_mm));
    }
  }
  const std::vector<float> share = diffusion::SharesOfTheWay(
      phantom.pattern, x_i, {x.data(), y.data(), cells}, channel.step_mm);
  const std::size_t last = channel.setup.substances.size() - 1;
  for (std::size_t cell = 0; cell < cells; ++cell) {
    const double f = static_cast<double>(share[cell]);
    const int col = static_cast<int>(cell % static_cast<std::size_t>(core)) - half;
    const int row = half - static_cast<int>(cell / static_cast<std::size_t>(core));
    double sum = 0;
    for (int b = row * channel.refine - sub; b <= row * channel.refine + sub; ++b) {
      for (int a = col * channel.refine - sub; a <= col * channel.refine + sub; ++a) {
        const auto column = static_cast<std::size_t>(
            static_cast<std::ptrdiff_t>(centre) + std::ptrdiff_t{b} * scene.nx + a);
        sum += exitance(column) *
               std::exp(std::lerp(channel.near_field->LogFactor(0, a, b),
                                  channel.near_field->LogFactor(last, a, b),
                                  f));
      }
    }
    rd[cell] = static_cast<float>(sum / (channel.refine * channel.refine));
  }
}

std::vector<Window> DiffusionTransport::Impl::Solve(const Neighbourhood& place) const {
  const std::size_t cells =
      static_cast<std::size_t>(core) * static_cast<std::size_t>(core);
  std::vector<Window> windows(place.points.size());
  for (Window& window : windows) {
    window.rd.resize(cells * channels.size());
    window.sigma.resize(window.rd.size());
  }
  for (std::size_t c = 0; c < channels.size(); ++c) {
    const Channel& channel = channels[c];
    const Scene scene = MakeScene(channel, place);
    LocalDomain<float> domain(channel.setup, scene.mesh, scene.fractions);
    domain.FromDepth(FromDepth());
    for (std::size_t lane = 0; lane < place.points.size(); ++lane) {
      AddBeam(channel, scene, place, place.points[lane], lane, domain);
    }
    domain.Solve(options.tolerance);
    for (std::size_t lane = 0; lane < place.points.size(); ++lane) {
      ReadWindow(
          channel,
          scene,
          place,
          place.points[lane],
          [&](std::size_t column) { return domain.Exitance(lane, column); },
          &windows[lane].rd[c * cells]);
    }
  }
  return windows;
}

void DiffusionTransport::SolveWindows(
    std::span<const PointMm> points,
    const std::function<void(std::size_t k, Window&& window)>& use,
    const ProgressFunction& progress) const {
  Expect(impl_->phantom.grid.points_x > 0, "a phantom with a grid");
  const std::vector<Neighbourhood> places =
      diffusion::GroupPoints(points, impl_->phantom.grid, LocalDomain<float>::kLanes);
  std::vector<std::vector<std::size_t>> units;
  units.reserve(places.size());
  for (const Neighbourhood& place : places) {
    units.push_back(place.indices);
  }
  SolveInUnits(
      units,
      [&](std::size_t unit) { return impl_->Solve(places[unit]); },
      use,
      progress);
}

Window DiffusionTransport::WindowAround(PointMm x_i) const {
  Expect(impl_->phantom.grid.points_x > 0, "a phantom with a grid");
  const std::vector<Neighbourhood> places = diffusion::GroupPoints(
      std::array{x_i}, impl_->phantom.grid, LocalDomain<float>::kLanes);
  return std::move(impl_->Solve(places.front()).front());
}

LocalDomain<float>::Budget DiffusionTransport::Impl::BudgetAt(
    PointMm x_i, std::size_t channel_index) const {
  const Channel& channel = channels[channel_index];
  const Neighbourhood place = diffusion::AloneAt(x_i);
  const Scene scene = MakeScene(channel, place);
  LocalDomain<double> domain(channel.setup, scene.mesh, scene.fractions);
  AddBeam(channel, scene, place, x_i, 0, domain);
  domain.Solve(std::min(options.tolerance, 1e-9));
  const auto budget = domain.BudgetOf(0);
  return {budget.top, budget.bottom, budget.sides, budget.absorbed};
}

Totals DiffusionTransport::TotalsAt(PointMm x_i, std::size_t channel) const {
  const auto budget = impl_->BudgetAt(x_i, channel);
  return {budget.top, budget.bottom, 1 - budget.top - budget.bottom};
}

double DiffusionTransport::TruncatedAt(PointMm x_i, std::size_t channel) const {
  return impl_->BudgetAt(x_i, channel).sides;
}

std::size_t DiffusionTransport::MemoryBytes() const {
  std::size_t most = 0;
  for (const Channel& channel : impl_->channels) {
    const Impl::Scene scene = impl_->MakeScene(
        channel, {.first = {}, .columns = 4, .rows = 4, .points = {}, .indices = {}});
    most = std::max(
        most,
        LocalDomain<float>(channel.setup, scene.mesh, scene.fractions).MemoryBytes());
  }
  return most;
}

}  // namespace nacre::rigs
