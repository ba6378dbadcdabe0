#include "factor/invariants.h"

#include "core/error.h"
#include "core/json.h"
#include "core/parallel.h"
#include "core/random.h"
#include "reconstruct/error_figures.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>

namespace nacre::factor {
namespace {

constexpr std::int64_t kMostSlices = 64;
constexpr int kPairsOfASlice = 64;

// What one slice has to say.
struct SliceLook {
  double least = std::numeric_limits<double>::infinity();
  std::vector<double> largest;                   ///< a channel
  std::vector<std::pair<double, double>> pairs;  ///< [pair][channel], both ways
};

[[noreturn]] void Refuse(
    const Material& m, std::size_t channel, int i, int j, std::int64_t cell, float rd) {
  throw BadData(fmt::format(
      "the {} model of these data has R_d = {} at slice ({}, {}), channel {}, cell "
      "({}, {}); R_d is finite and not negative. Values near the limits of a float "
      "(1e-38 to 1e38) do that: scale the data, or take another --method",
      m.method,
      rd,
      i,
      j,
      m.channels[channel],
      cell % m.core,
      cell / m.core));
}

void LookAtWindows(const Material& m, int i, int j, SliceLook& look) {
  std::vector<float> window(static_cast<std::size_t>(m.WindowSize()));
  look.largest.assign(m.channels.size(), 0);
  for (std::size_t c = 0; c < m.channels.size(); ++c) {
    m.EvaluateWindow(static_cast<int>(c), i, j, window.data());
    for (std::size_t cell = 0; cell < window.size(); ++cell) {
      const auto rd = static_cast<double>(window[cell]);
      if (!(rd >= 0) || !std::isfinite(rd)) {
        Refuse(m, c, i, j, static_cast<std::int64_t>(cell), window[cell]);
      }
      look.least = std::min(look.least, rd);
      look.largest[c] = std::max(look.largest[c], rd);
    }
  }
}

void LookAtPairs(
    const Material& m, int i, int j, RandomStream& random, SliceLook& look) {
  const int radius = (m.core - 1) / 2;
  for (int pair = 0; pair < kPairsOfASlice; ++pair) {
    const int u = static_cast<int>(random.Uniform() * m.core);
    const int v = static_cast<int>(random.Uniform() * m.core);
    const int to_i = i + u - radius;
    const int to_j = j + v - radius;
    if (to_i < 0 || to_i >= m.points_x || to_j < 0 || to_j >= m.points_y ||
        (to_i == i && to_j == j)) {
      continue;
    }
    for (int c = 0; c < static_cast<int>(m.channels.size()); ++c) {
      look.pairs.emplace_back(
          m.Evaluate(c, i, j, u, v),
          m.Evaluate(c, to_i, to_j, m.core - 1 - u, m.core - 1 - v));
    }
  }
}

void AddTotals(const Material& m, Invariants& found) {
  const auto points = static_cast<std::size_t>(m.PointCount());
  for (std::size_t at = 0; at < m.albedo.size(); ++at) {
    const auto total = static_cast<double>(m.albedo[at]);
    found.above_one += total > Invariants::kMostTotal ? 1 : 0;
    if (total > found.largest_total) {
      const auto point = static_cast<std::int64_t>(at % points);
      found.largest_total = total;
      found.largest_total_i = static_cast<int>(point % m.points_x);
      found.largest_total_j = static_cast<int>(point / m.points_x);
      found.largest_total_channel = m.channels[at / points];
    }
  }
}

void AddPairs(const std::vector<SliceLook>& looks,
              const std::vector<double>& largest,
              Invariants& found) {
  double sum = 0;
  for (const SliceLook& look : looks) {
    for (std::size_t n = 0; n < look.pairs.size(); ++n) {
      const auto [a, b] = look.pairs[n];
      const double mean = 0.5 * (a + b);
      if (mean > reconstruct::kLogFloor * largest[n % largest.size()]) {
        const double relative = (a - b) / mean;
        sum += relative * relative;
        ++found.pairs;
      }
    }
  }
  found.asymmetry =
      found.pairs > 0 ? std::sqrt(sum / static_cast<double>(found.pairs)) : 0;
}

}  // namespace

Invariants CheckInvariants(const Material& m, std::uint64_t seed, int thread_count) {
  const std::int64_t points = m.PointCount();
  const std::int64_t count = std::min(points, kMostSlices);
  std::vector<SliceLook> looks(static_cast<std::size_t>(count));
  ParallelFor(count, thread_count, [&](std::int64_t n) {
    // One in each of as many stretches of the grid.
    RandomStream random(seed, 0x696e7661ULL + static_cast<std::uint64_t>(n));
    const std::int64_t first = n * points / count;
    const std::int64_t size = (n + 1) * points / count - first;
    const std::int64_t point =
        first + static_cast<std::int64_t>(random.Uniform() * static_cast<double>(size));
    const int i = static_cast<int>(point % m.points_x);
    const int j = static_cast<int>(point / m.points_x);
    SliceLook& look = looks[static_cast<std::size_t>(n)];
    LookAtWindows(m, i, j, look);
    LookAtPairs(m, i, j, random, look);
  });
  Invariants found;
  found.slices = count;
  found.least = std::numeric_limits<double>::infinity();
  std::vector<double> largest(m.channels.size(), 0);
  for (const SliceLook& look : looks) {
    found.least = std::min(found.least, look.least);
    for (std::size_t c = 0; c < largest.size(); ++c) {
      largest[c] = std::max(largest[c], look.largest[c]);
    }
  }
  found.largest = *std::max_element(largest.begin(), largest.end());
  AddTotals(m, found);
  AddPairs(looks, largest, found);
  return found;
}

std::string Invariants::Brief() const {
  return fmt::format(
      "R_d from {:.2g} to {:.2g} mm^-2 and finite on {} slices; totals {} 1 (largest "
      "{:.3g}); {:.2g} % between the two ways of {} pairs",
      least,
      largest,
      slices,
      above_one == 0 ? "within" : "ABOVE",
      largest_total,
      100 * asymmetry,
      pairs);
}

std::string Invariants::EnergyNote() const {
  if (above_one == 0) {
    return {};
  }
  return fmt::format(
      "energy: {} totals of slices are above 1, the largest {:.4g} at ({}, {}), "
      "channel "
      "{}: more light leaves there than came in. See whether the data are in mm^-2 and "
      "their flux is calibrated; `nacre edit` without options makes slices give 1 at "
      "most",
      above_one,
      largest_total,
      largest_total_i,
      largest_total_j,
      largest_total_channel);
}

Json Invariants::ToJson() const {
  return {{"slices", slices},
          {"least", least},
          {"largest", largest},
          {"finite", true},
          {"largest_total", largest_total},
          {"largest_total_at", {largest_total_i, largest_total_j}},
          {"largest_total_channel", largest_total_channel},
          {"above_one", above_one},
          {"pairs", pairs},
          {"asymmetry", asymmetry}};
}

}  // namespace nacre::factor
