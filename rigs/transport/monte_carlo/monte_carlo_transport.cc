#include "rigs/transport/monte_carlo/monte_carlo_transport.h"

#include "core/error.h"
#include "core/random.h"
#include "core/ranks.h"
#include "rigs/transport/monte_carlo/tally.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <string>
#include <utility>

namespace nacre::rigs::monte_carlo {
namespace {

// A seed of its own for every beam: the seed, the channel and x_i, well mixed.
std::int64_t SeedOf(std::int64_t seed, std::size_t channel, PointMm x_i) {
  const auto key = static_cast<std::uint64_t>(seed);
  std::array<std::uint32_t, 4> block{0, 0, static_cast<std::uint32_t>(channel), 0};
  for (const double coordinate : {x_i.x, x_i.y}) {
    const auto bits = std::bit_cast<std::uint64_t>(coordinate);
    block[0] ^= static_cast<std::uint32_t>(bits);
    block[1] ^= static_cast<std::uint32_t>(bits >> 32);
    block = Philox(
        block,
        {static_cast<std::uint32_t>(key), static_cast<std::uint32_t>(key >> 32)});
  }
  return static_cast<std::int64_t>((static_cast<std::uint64_t>(block[0] >> 1) << 32) |
                                   block[1]);
}

// Positions are single precision; where the volume repeats, a beam far out is as one
// near the origin.
PointMm NearOrigin(const Volume& volume, PointMm x_i) {
  const auto reduced = [](double coordinate_mm, double period_mm) {
    return coordinate_mm - period_mm * std::round(coordinate_mm / period_mm);
  };
  if (volume.voxels || volume.box) {
    return x_i;
  }
  const double period_mm = 2 * volume.pattern.cell_mm;
  switch (volume.pattern.type) {
    case PatternType::kHomogeneous:
      return {0, 0};
    case PatternType::kChessboard:
      return {reduced(x_i.x, period_mm), reduced(x_i.y, period_mm)};
    case PatternType::kStripes:
      return {reduced(x_i.x, period_mm), 0};
    default:
      return x_i;
  }
}

bool OnBorder(double coordinate_mm, double cell_mm) {
  const double u = coordinate_mm / cell_mm;
  return std::abs(u - std::round(u)) < 1e-6;
}

// A pencil on the border of two media enters both: it is the limit of beams that
// narrow, not whatever cell rounding finds it in.
Source SharedAtBorders(Source source, const Pattern& pattern) {
  const bool in_cells =
      pattern.type == PatternType::kChessboard || pattern.type == PatternType::kStripes;
  if (!in_cells || source.shape != BeamShape::kPencil) {
    return source;
  }
  const bool on_border = source.footprint ||  // which may have places on borders
                         OnBorder(source.centre.x, pattern.cell_mm) ||
                         (pattern.type == PatternType::kChessboard &&
                          OnBorder(source.centre.y, pattern.cell_mm));
  if (on_border) {
    source.shape = BeamShape::kSquare;
    source.width_mm = 1e-4 * pattern.cell_mm;
  }
  return source;
}

void RequireFinite(PointMm x_i) {
  if (!std::isfinite(x_i.x) || !std::isfinite(x_i.y)) {
    throw BadData("Monte Carlo: a beam at (" + std::to_string(x_i.x) + ", " +
                  std::to_string(x_i.y) + ") mm; positions must be finite");
  }
}

// Photons for the error to fall to `wanted`, by the root law and with 5 % to spare.
std::int64_t PhotonsFor(const Result& result, double wanted, std::int64_t most) {
  constexpr double kMostGrowth = 64;  // an estimate from few photons is a rough one
  const double ratio = RelativeError(result) / wanted;
  const double growth = std::clamp(1.05 * ratio * ratio, 1.1, kMostGrowth);
  return static_cast<std::int64_t>(
      std::min(static_cast<double>(most),
               std::ceil(growth * static_cast<double>(result.photon_count))));
}

}  // namespace

double RelativeError(const Totals& totals) {
  constexpr double kLeast = 0.01;
  return std::max(totals.reflected_se / std::max(totals.reflected, kLeast),
                  totals.transmitted_se / std::max(totals.transmitted, kLeast));
}

Totals ToTotals(const Result& result) {
  const double absorbed =
      result.absorbed.mean + result.backing.mean + result.sides.mean;
  return {.reflected = result.reflected.mean,
          .transmitted = result.transmitted.mean,
          .absorbed = absorbed,
          .reflected_se = result.reflected.se,
          .transmitted_se = result.transmitted.se,
          .absorbed_se = BinomialEstimate(absorbed, result.photon_count).se,
          .photons = result.photon_count};
}

double RelativeError(const Result& result) {
  if (result.window_per_mm2.empty()) {
    return RelativeError(ToTotals(result));
  }
  double value = 0;
  double error = 0;
  for (const Estimate& cell : result.window_per_mm2) {
    value += cell.mean;
    error += cell.se;
  }
  return std::sqrt(2 / std::numbers::pi) * error / value;
}

MonteCarloTransport::MonteCarloTransport(const Phantom& phantom,
                                         const Options& options,
                                         const BeamOptions& beam_options,
                                         const ProgressFunction& progress)
    : Transport(options.thread_count, options.ranks),
      phantom_(phantom),
      options_(options),
      beam_options_(beam_options),
      progress_(progress) {
  nacre::Validate(options);
  for (std::size_t c = 0; c < phantom.channels.size(); ++c) {
    volumes_.push_back(MakeVolume(phantom, c));
    monte_carlo::Validate(volumes_.back());
  }
}

Source MonteCarloTransport::SourceAt(PointMm x_i) const {
  Source source = MakeSource(phantom_.beam, x_i);
  source.diffuse = beam_options_.diffuse;
  return source;
}

Result MonteCarloTransport::Run(Simulation& simulation,
                                const ProgressFunction& progress) const {
  if (!(beam_options_.wanted_error > 0)) {
    simulation.Add(options_.photon_count, progress);
    return simulation.Get();
  }
  constexpr std::int64_t kPilot = 1 << 16;
  std::int64_t target = std::min(kPilot, options_.photon_count);
  std::int64_t done = 0;
  for (;;) {
    simulation.Add(target - done, progress);
    done = target;
    Result result = simulation.Get();
    if (RelativeError(result) <= beam_options_.wanted_error ||
        done >= options_.photon_count) {
      return result;
    }
    target = PhotonsFor(result, beam_options_.wanted_error, options_.photon_count);
  }
}

MonteCarloTransport::Task MonteCarloTransport::TaskAt(
    PointMm x_i, std::size_t channel, const TallyRequest& request) const {
  RequireFinite(x_i);
  const PointMm near = NearOrigin(volumes_[channel], x_i);
  TallyRequest moved = request;
  moved.window_centre = {near.x + (request.window_centre.x - x_i.x),
                         near.y + (request.window_centre.y - x_i.y)};
  return {SourceAt(near), channel, moved};
}

Result MonteCarloTransport::Solve(const Task& task,
                                  const Ranks* ranks,
                                  const ProgressFunction& progress) const {
  Options options = options_;
  options.seed = SeedOf(options_.seed, task.channel, task.source.centre);
  options.ranks = ranks;
  const Volume& volume = volumes_[task.channel];
  Simulation simulation(
      volume, SharedAtBorders(task.source, volume.pattern), task.request, options);
  return Run(simulation, progress ? progress : progress_);
}

Result MonteCarloTransport::Simulate(PointMm x_i,
                                     std::size_t channel,
                                     const TallyRequest& request,
                                     const ProgressFunction& progress) const {
  return Solve(TaskAt(x_i, channel, request), ranks(), progress);
}

Result MonteCarloTransport::SimulateLight(const Source& source,
                                          std::size_t channel,
                                          const TallyRequest& request,
                                          const ProgressFunction& progress) const {
  return Solve({source, channel, request}, ranks(), progress);
}

Window MonteCarloTransport::WindowAround(PointMm x_i) const {
  return WindowBy(x_i, ranks(), {});
}

Window MonteCarloTransport::WindowBy(PointMm x_i,
                                     const Ranks* ranks,
                                     const ProgressFunction& progress) const {
  Expect(phantom_.grid.points_x > 0, "a phantom with a grid");
  const TallyRequest request{.window_centre = x_i,
                             .window_core = phantom_.grid.core,
                             .window_pitch_mm = phantom_.grid.pitch_mm,
                             .use_symmetry = true};
  Window window;
  const auto channels = static_cast<std::int64_t>(volumes_.size());
  for (std::int64_t c = 0; c < channels; ++c) {
    const Result result = Solve(TaskAt(x_i, static_cast<std::size_t>(c), request),
                                ranks,
                                PartOf(progress, c, channels));
    for (const Estimate& cell : result.window_per_mm2) {
      window.rd.push_back(static_cast<float>(cell.mean));
      window.sigma.push_back(static_cast<float>(cell.se));
    }
  }
  return window;
}

// Counts of a beam's photons are summed over all ranks if these share them, which is
// more than a window of R_d: so beams go to ranks as long as there are enough.
void MonteCarloTransport::SolveWindows(
    std::span<const PointMm> points,
    const std::function<void(std::size_t k, Window&& window)>& use,
    const ProgressFunction& progress) const {
  constexpr int kTag = 31;
  const auto count = static_cast<std::int64_t>(points.size());
  const int size = ranks() == nullptr ? 1 : ranks()->size();
  const int rank = ranks() == nullptr ? 0 : ranks()->rank();
  const std::int64_t by_rank = size == 1 ? 0 : count / size * size;
  for (std::int64_t k = 0; k < count; ++k) {
    const auto at = static_cast<std::size_t>(k);
    const int owner = static_cast<int>(k % size);
    const bool is_shared = k >= by_rank;
    Window window;
    if (is_shared || owner == rank) {
      window = WindowBy(
          points[at], is_shared ? ranks() : nullptr, PartOf(progress, k, count));
    }
    if (!is_shared && owner == rank && rank != 0) {
      ranks()->Flush();  // no more than one on its way
      ranks()->Post(0,
                    kTag,
                    ToBytes(std::span<const float>(window.rd)) +
                        ToBytes(std::span<const float>(window.sigma)));
    }
    if (rank != 0) {
      continue;
    }
    if (!is_shared && owner != 0) {
      const auto values = FromBytes<float>(ranks()->Receive(kTag, owner).bytes);
      const auto half = values.begin() + std::ssize(values) / 2;
      window = {{values.begin(), half}, {half, values.end()}};
    }
    use(at, std::move(window));
  }
}

void MonteCarloTransport::AddExitance(PointMm x_i,
                                      std::size_t channel,
                                      double flux,
                                      const PointColumns& points,
                                      float* exitance) const {
  const double pitch_mm = phantom_.grid.pitch_mm;
  if (!(pitch_mm > 0)) {
    throw BadData(
        "Monte Carlo: exitance is counted in the cells of the phantom's [grid], which "
        "is missing; add one with the pitch_mm to resolve");
  }
  const auto cells_from_centre = [&](float coordinate_mm, double centre_mm) {
    return std::lround((static_cast<double>(coordinate_mm) - centre_mm) / pitch_mm);
  };
  long radius = 0;
  for (std::size_t k = 0; k < points.count; ++k) {
    radius = std::max({radius,
                       std::abs(cells_from_centre(points.x_mm[k], x_i.x)),
                       std::abs(cells_from_centre(points.y_mm[k], x_i.y))});
  }
  // Beyond reach there is nothing worth a table.
  radius = std::min(radius, std::lround(std::ceil(ReachMm(channel) / pitch_mm)));
  const TallyRequest request{.window_centre = x_i,
                             .window_core = static_cast<int>(2 * radius + 1),
                             .window_pitch_mm = pitch_mm,
                             .use_symmetry = true};
  const Result result = Simulate(x_i, channel, request);
  for (std::size_t k = 0; k < points.count; ++k) {
    const long u = radius + cells_from_centre(points.x_mm[k], x_i.x);
    const long v = radius - cells_from_centre(points.y_mm[k], x_i.y);
    if (u >= 0 && v >= 0 && u < request.window_core && v < request.window_core) {
      exitance[k] += static_cast<float>(
          flux *
          result.window_per_mm2[static_cast<std::size_t>(v * request.window_core + u)]
              .mean);
    }
  }
}

double MonteCarloTransport::FindReachMm(std::size_t channel) const {
  constexpr double kLossBeyondReach = 1e-4;
  constexpr int kRings = 100'000;
  const Volume& volume = volumes_[channel];
  double shortest_mm = std::numeric_limits<double>::infinity();
  for (const Optics& m : volume.media) {
    const double sigma = m.sigma_a_per_mm + m.sigma_s_per_mm * (1 - m.g);
    shortest_mm = sigma > 0 ? std::min(shortest_mm, 1 / sigma) : shortest_mm;
  }
  shortest_mm = std::isfinite(shortest_mm) ? shortest_mm : volume.DepthMm();
  const double cell_mm = phantom_.pattern.cell_mm;
  double reach_mm = 0;
  for (int k = 0; k < phantom_.pattern.MediumCount(); ++k) {
    const PointMm x_i{(0.5 + k) * cell_mm, 0.5 * cell_mm};  // the middle of a cell
    const TallyRequest request{
        .window_centre = x_i, .ring_count = kRings, .ring_width_mm = 0.1 * shortest_mm};
    Options options = options_;
    options.photon_count = 400'000;
    options.seed = SeedOf(options_.seed, channel, x_i);
    const Result r = monte_carlo::Simulate(volume, SourceAt(x_i), request, options);
    // Outwards, until the light beyond is little enough to leave out.
    double beyond = r.reflected.mean;
    const double width = request.ring_width_mm;
    int ring = 0;
    while (ring < kRings && beyond > kLossBeyondReach) {
      const double area = std::numbers::pi * (2.0 * ring + 1) * width * width;
      beyond -= r.ring_per_mm2[static_cast<std::size_t>(ring)].mean * area;
      ++ring;
    }
    reach_mm = std::max(reach_mm, ring * width);
  }
  return reach_mm;
}

double MonteCarloTransport::ReachMm(std::size_t channel) const {
  std::call_once(reach_found_, [this] {
    for (std::size_t c = 0; c < volumes_.size(); ++c) {
      reach_mm_.push_back(FindReachMm(c));
    }
  });
  return reach_mm_[channel];
}

Totals MonteCarloTransport::TotalsAt(PointMm x_i, std::size_t channel) const {
  return ToTotals(Simulate(x_i, channel, {}));
}

}  // namespace nacre::rigs::monte_carlo
