#include "rigs/transport/diffusion/diffusion_transport.h"

#include "core/error.h"
#include "core/parallel.h"
#include "rigs/transport/diffusion/beam_footprint.h"
#include "rigs/transport/diffusion/local_domain.h"
#include "rigs/transport/diffusion/near_field.h"
#include "rigs/transport/diffusion/neighbourhoods.h"
#include "rigs/transport/diffusion/radial_profile.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>
#include <utility>
#include <vector>

namespace nacre::rigs {

using diffusion::BeamPoint;
using diffusion::ChannelSetup;
using diffusion::DomainLayout;
using diffusion::LocalDomain;
using diffusion::Mesh;
using diffusion::NearField;
using diffusion::Neighbourhood;
using diffusion::PatternFractions;
using diffusion::RadialProfile;

struct DiffusionTransport::Channel {
  ChannelSetup setup;
  int refine = 1;  // columns across a cell of the grid, odd
  double step_mm = 1;
  std::vector<BeamPoint> beam;
  std::vector<RadialProfile> profiles;
  std::unique_ptr<NearField> near_field;
  double reach_mm = 0;
};

struct DiffusionTransport::Impl {
  Phantom phantom;
  DiffusionOptions options;
  double pitch_mm = 1;  // of the grid, or of columns if there is none
  int core = 1;
  std::vector<Channel> channels;

  // A mesh for the beams of one neighbourhood, and what it is filled with.
  struct Scene {
    Mesh mesh;
    PatternFractions fractions;
    int margin = 0;
    int nx = 0;
  };
  Scene MakeScene(const Channel& channel, const Neighbourhood& place) const;
  template <class Real>
  void AddBeam(const Channel& channel,
               const Scene& scene,
               const Neighbourhood& place,
               PointMm x_i,
               std::size_t lane,
               LocalDomain<Real>& domain) const;
  void ReadWindow(const Channel& channel,
                  const Scene& scene,
                  const Neighbourhood& place,
                  PointMm x_i,
                  const std::function<double(std::size_t column)>& exitance,
                  float* rd) const;
  LocalDomain<float>::Budget BudgetAt(PointMm x_i, std::size_t channel) const;
  std::size_t CentreColumn(const Channel& channel,
                           const Scene& scene,
                           const Neighbourhood& place,
                           PointMm x_i) const;
  std::vector<Window> Solve(const Neighbourhood& place) const;
};

namespace {

// The smallest odd number that is not less.
int OddAtLeast(double value) {
  const int whole = std::max(1, static_cast<int>(std::ceil(value - 1e-9)));
  return whole % 2 == 1 ? whole : whole + 1;
}

double ShortestFreePathMm(const Phantom& phantom, std::size_t channel) {
  double shortest = std::numeric_limits<double>::infinity();
  for (const Medium& medium : phantom.media) {
    shortest = std::min(
        shortest,
        1 / (medium.sigma_a_per_mm[channel] + medium.ReducedScattering(channel)));
  }
  return shortest;
}

}  // namespace

DiffusionTransport::DiffusionTransport(const Phantom& phantom,
                                       const DiffusionOptions& options,
                                       const ReferenceProfile& reference) {
  Validate(options);
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
    double shortest = std::numeric_limits<double>::infinity();
    for (std::size_t c = 0; c < channel_count; ++c) {
      shortest = std::min(shortest, ShortestFreePathMm(phantom, c));
    }
    impl->pitch_mm = options.step_free_paths * shortest;
    impl->core = 21;
  }
  const double half_window_mm = 0.5 * impl->core * impl->pitch_mm;
  for (std::size_t c = 0; c < channel_count; ++c) {
    Channel channel;
    channel.setup = diffusion::MakeChannelSetup(phantom, c, options, half_window_mm);
    const ChannelSetup& setup = channel.setup;
    channel.refine = OddAtLeast(
        impl->pitch_mm / (options.step_free_paths * setup.shortest_free_path_mm));
    channel.step_mm = impl->pitch_mm / channel.refine;
    channel.beam = diffusion::BeamFootprint(phantom.beam, channel.step_mm);
    const double last_mm =
        2 * (half_window_mm + setup.margin_mm + 10 * setup.shortest_free_path_mm);
    for (std::size_t m = 0; m < setup.substances.size(); ++m) {
      const RobinSlab exact(setup.substances[m].slab);
      channel.profiles.emplace_back(
          [&](double r_mm) {
            return reference ? reference(m, c, r_mm) : exact.Reflectance(r_mm);
          },
          1e-4 * setup.shortest_free_path_mm,
          last_mm,
          options.thread_count);
      channel.reach_mm =
          std::max(channel.reach_mm,
                   channel.profiles.back().Reach(1e-4) + 0.5 * phantom.beam.width_mm);
    }
    channel.near_field = std::make_unique<NearField>(
        setup,
        NearField::Request{.step_mm = channel.step_mm,
                           .half_columns = (impl->core * channel.refine - 1) / 2,
                           .reciprocal_exit = options.reciprocal_exit,
                           .tolerance = std::min(options.tolerance, 1e-8)},
        channel.beam,
        channel.profiles);
    impl->channels.push_back(std::move(channel));
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
  return static_cast<std::size_t>(cells(x_i.y - place.first.y) * scene.nx +
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
  // Points of one column and medium follow each other often: deposit them together.
  std::size_t column = 0;
  std::size_t medium = 0;
  double flux = 0;
  for (const BeamPoint& point : channel.beam) {
    const std::size_t at = static_cast<std::size_t>(
        centre + std::ptrdiff_t{point.column_y} * scene.nx + point.column_x);
    const auto here = static_cast<std::size_t>(phantom.pattern.MediumAt(
        {x_i.x + point.offset_mm.x, x_i.y + point.offset_mm.y}));
    if (flux > 0 && (at != column || here != medium)) {
      domain.AddBeam(lane, column, medium, flux);
      flux = 0;
    }
    column = at;
    medium = here;
    flux += point.weight;
  }
  domain.AddBeam(lane, column, medium, flux);
}

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
  std::vector<float> fraction(cells);
  phantom.pattern.SecondMediumFraction(
      x_i, {x.data(), y.data(), cells}, fraction.data());
  const std::size_t last = channel.setup.substances.size() - 1;
  for (std::size_t cell = 0; cell < cells; ++cell) {
    const double f = static_cast<double>(fraction[cell]);
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
    if (options.reciprocal_exit) {
      domain.UseReciprocalExit();
    }
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
  std::mutex mutex;
  std::int64_t done = 0;
  const auto total = static_cast<std::int64_t>(points.size());
  ParallelFor(static_cast<std::int64_t>(places.size()),
              impl_->options.thread_count,
              [&](std::int64_t p) {
                const Neighbourhood& place = places[static_cast<std::size_t>(p)];
                std::vector<Window> windows = impl_->Solve(place);
                const std::lock_guard lock(mutex);
                for (std::size_t lane = 0; lane < windows.size(); ++lane) {
                  use(place.indices[lane], std::move(windows[lane]));
                }
                done += static_cast<std::int64_t>(windows.size());
                Report(progress, {"simulate", done, total, ""});
              });
}

Window DiffusionTransport::WindowAround(PointMm x_i) const {
  Window result;
  SolveWindows(std::array{x_i},
               [&](std::size_t, Window&& window) { result = std::move(window); });
  return result;
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

// The mesh gives how much the pattern changes what a homogeneous slab would do, column
// by column, which is smooth; the homogeneous slab's exitance at a point is the
// profile's.
void DiffusionTransport::AddExitance(PointMm x_i,
                                     std::size_t channel_index,
                                     double flux,
                                     const PointColumns& points,
                                     float* exitance) const {
  const Channel& channel = impl_->channels[channel_index];
  const Neighbourhood place = diffusion::AloneAt(x_i);
  const Impl::Scene scene = impl_->MakeScene(channel, place);
  const std::size_t last = channel.setup.substances.size() - 1;

  // log of discrete exitance over the homogeneous one of the beam's medium.
  const auto home = static_cast<std::size_t>(impl_->phantom.pattern.MediumAt(x_i));
  PatternFractions same = scene.fractions;
  for (auto* values : {&same.column, &same.east, &same.north}) {
    std::fill(values->begin(), values->end(), home == last && last > 0 ? 1.0F : 0.0F);
  }
  const std::size_t centre = impl_->CentreColumn(channel, scene, place, x_i);
  LocalDomain<double> mixed(channel.setup, scene.mesh, scene.fractions);
  LocalDomain<double> pure(channel.setup, scene.mesh, same);
  impl_->AddBeam(channel, scene, place, x_i, 0, mixed);
  for (const BeamPoint& point : channel.beam) {
    pure.AddBeam(0,
                 static_cast<std::size_t>(static_cast<std::ptrdiff_t>(centre) +
                                          std::ptrdiff_t{point.column_y} * scene.nx +
                                          point.column_x),
                 home,
                 point.weight);
  }
  mixed.Solve(impl_->options.tolerance);
  pure.Solve(impl_->options.tolerance);
  std::vector<double> logs(scene.fractions.column.size());
  for (std::size_t c = 0; c < logs.size(); ++c) {
    logs[c] = std::log(std::max(mixed.Exitance(0, c), 1e-300) /
                       std::max(pure.Exitance(0, c), 1e-300));
  }

  const auto place_on = [](const diffusion::Axis& axis, double at, int* low) {
    int i = 0;
    const auto above = std::upper_bound(axis.edges_mm.begin(), axis.edges_mm.end(), at);
    i = static_cast<int>(above - axis.edges_mm.begin()) - 1;
    i = std::clamp(at < axis.Centre(std::clamp(i, 0, axis.Count() - 1)) ? i - 1 : i,
                   0,
                   axis.Count() - 2);
    *low = i;
    const double t = (at - axis.Centre(i)) / (axis.Centre(i + 1) - axis.Centre(i));
    return std::clamp(t, 0.0, 1.0);
  };
  // A pencil is one point, whatever the four that stand for it.
  const bool pencil = impl_->phantom.beam.shape == BeamShape::kPencil;
  for (std::size_t k = 0; k < points.count; ++k) {
    const double x = static_cast<double>(points.x_mm[k]);
    const double y = static_cast<double>(points.y_mm[k]);
    int i = 0;
    int j = 0;
    const double s = place_on(scene.mesh.x, x, &i);
    const double t = place_on(scene.mesh.y, y, &j);
    const auto at = static_cast<std::size_t>(j * scene.nx + i);
    const auto nx = static_cast<std::size_t>(scene.nx);
    const double log_ratio = std::lerp(std::lerp(logs[at], logs[at + 1], s),
                                       std::lerp(logs[at + nx], logs[at + nx + 1], s),
                                       t);
    double alone = 0;
    if (pencil) {
      alone = channel.profiles[home].Value(std::hypot(x - x_i.x, y - x_i.y));
    } else {
      for (const BeamPoint& point : channel.beam) {
        alone += point.weight *
                 channel.profiles[home].Value(std::hypot(
                     x - x_i.x - point.offset_mm.x, y - x_i.y - point.offset_mm.y));
      }
    }
    exitance[k] += static_cast<float>(flux * alone * std::exp(log_ratio));
  }
}

}  // namespace nacre::rigs
