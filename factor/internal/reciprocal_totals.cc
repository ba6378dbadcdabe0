#include "factor/internal/reciprocal_totals.h"

#include "core/parallel.h"
#include "core/rank_shares.h"
#include "factor/internal/reciprocal.h"
#include "factor/internal/reciprocal_sums.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <span>

namespace nacre::factor::internal {
namespace {

constexpr int kMostRounds = 12;
constexpr int kReach = 2;        // points around one that is out of bounds
constexpr double kFarthest = 2;  // factors stay below it, and above its inverse

// What the total of a slice's whole modelled window may be.
struct Interval {
  double low = 0;
  double high = 1e300;
};

Interval Around(double total, double bound) {
  return {total * (1 - bound), total * (1 + bound)};
}

// All cells being measured, the totals are what they should be.
std::vector<Interval> KnownWanted(const Job& job, double bound) {
  std::vector<Interval> wanted(job.totals.size());
  for (std::size_t n = 0; n < wanted.size(); ++n) {
    if (job.totals[n] > 0) {
      wanted[n] = Around(job.totals[n], bound);
    }
  }
  return wanted;
}

// What a slice adds up to with the model's values, scaled to the measured ones, where
// nothing was measured; none if either is dark.
std::optional<double> WholeTotal(std::span<const float> rd,
                                 std::span<const std::uint8_t> valid,
                                 std::span<const float> values) {
  double measured = 0;
  double modelled = 0;
  double whole = 0;
  for (std::size_t n = 0; n < rd.size(); ++n) {
    const auto value = static_cast<double>(values[n]);
    whole += value;
    if (valid[n] != 0) {
      measured += static_cast<double>(rd[n]);
      modelled += value;
    }
  }
  if (measured > 0 && modelled > 0) {
    return measured * whole / modelled;
  }
  return std::nullopt;
}

std::vector<Interval> Wanted(Job& job, double bound, const Material& m) {
  if (!job.totals.empty()) {
    return KnownWanted(job, bound);
  }
  const auto window = static_cast<std::size_t>(m.WindowSize());
  const std::int64_t points = m.PointCount();
  const auto channels = static_cast<int>(m.channels.size());
  std::vector<Interval> wanted(m.row_scale.size());
  const RankShare share = ShareOf(points, job.options.ranks);
  for (std::int64_t first = share.begin; first < share.end; first += kBlockRows) {
    Report(job.progress, {"factor", first, points, "totals"});
    const SliceBlock block =
        job.source.Read(first, std::min(kBlockRows, share.end - first));
    ParallelFor(block.count, job.options.thread_count, [&](std::int64_t row) {
      const std::int64_t point = first + row;
      std::vector<float> values(window * m.channels.size());
      ReciprocalWindows(
          m,
          {static_cast<int>(point % m.points_x), static_cast<int>(point / m.points_x)},
          0,
          channels,
          values.data());
      const std::size_t slice = static_cast<std::size_t>(row) * values.size();
      for (std::size_t c = 0; c < m.channels.size(); ++c) {
        const std::size_t at = slice + c * window;
        const auto total =
            WholeTotal({block.rd + at, window},
                       {block.valid + at, window},
                       std::span<const float>(values).subspan(c * window, window));
        if (total) {
          wanted[c * static_cast<std::size_t>(points) +
                 static_cast<std::size_t>(point)] = Around(*total, bound);
        }
      }
    });
  }
  for (std::size_t c = 0; c < m.channels.size(); ++c) {
    JoinShares(points,
               job.options.ranks,
               std::span(wanted).subspan(c * static_cast<std::size_t>(points),
                                         static_cast<std::size_t>(points)));
  }
  ++job.passes;
  return wanted;
}

double TotalOf(const Material& m, int channel, std::int64_t point) {
  std::vector<float> values(static_cast<std::size_t>(m.WindowSize()));
  m.EvaluateWindow(channel,
                   static_cast<int>(point % m.points_x),
                   static_cast<int>(point / m.points_x),
                   values.data());
  return std::accumulate(values.begin(), values.end(), 0.0);
}

// Points to look at again: those that a change nearby may move.
void Spread(const Material& m, std::int64_t point, std::vector<std::uint8_t>& marked) {
  const auto x = static_cast<int>(point % m.points_x);
  const auto y = static_cast<int>(point / m.points_x);
  for (int j = std::max(0, y - kReach); j <= std::min(m.points_y - 1, y + kReach);
       ++j) {
    for (int i = std::max(0, x - kReach); i <= std::min(m.points_x - 1, x + kReach);
         ++i) {
      marked[static_cast<std::size_t>(std::int64_t{j} * m.points_x + i)] = 1;
    }
  }
}

// `totals` are those to begin with.
void BalanceChannel(const Job& job,
                    int channel,
                    const double* totals,
                    const Interval* wanted,
                    float step,
                    Material& m) {
  const auto points = static_cast<std::size_t>(m.PointCount());
  float* scale = &m.row_scale[static_cast<std::size_t>(channel) * points];
  std::vector<std::uint8_t> marked(points, 1);
  const RankShare share = ShareOf(m.PointCount(), job.options.ranks);
  for (int round = 0; round < kMostRounds; ++round) {
    std::vector<float> next(scale, scale + points);
    const std::int64_t count = share.end - share.begin;
    ParallelFor(count, job.options.thread_count, [&](std::int64_t own) {
      const std::int64_t p = share.begin + own;
      const auto n = static_cast<std::size_t>(p);
      if (marked[n] == 0) {
        return;
      }
      const double total = round == 0 ? totals[n] : TotalOf(m, channel, p);
      const double goal = std::clamp(total, wanted[n].low, wanted[n].high);
      if (goal != total) {
        const double factor = static_cast<double>(scale[n]) * std::sqrt(goal / total);
        next[n] = static_cast<float>(std::clamp(factor, 1 / kFarthest, kFarthest));
      }
    });
    JoinShares(m.PointCount(), job.options.ranks, std::span(next));
    std::fill(marked.begin(), marked.end(), std::uint8_t{0});
    bool moved = false;
    for (std::size_t p = 0; p < points; ++p) {
      if (std::abs(next[p] - scale[p]) > 0.1F * step) {
        Spread(m, static_cast<std::int64_t>(p), marked);
        moved = true;
      }
      scale[p] = next[p];
    }
    if (!moved) {
      break;
    }
  }
  for (std::size_t p = 0; p < points; ++p) {
    scale[p] = std::nearbyint(scale[p] / step) * step;
  }
}

}  // namespace

void BalanceTotals(Job& job, double bound, Material& m) {
  const auto step =
      static_cast<float>(std::exp2(std::floor(std::log2(std::max(bound, 1e-6) / 4))));
  if (!m.steps.empty()) {
    m.steps.row_scale = step;
  }
  const std::vector<Interval> wanted =
      Wanted(job, std::max(bound - static_cast<double>(step), 0.0), m);
  const std::vector<double> totals = ReciprocalTotals(m, WorkersOf(job));
  for (int c = 0; c < static_cast<int>(m.channels.size()); ++c) {
    const auto first = static_cast<std::size_t>(c * m.PointCount());
    BalanceChannel(job, c, &totals[first], &wanted[first], step, m);
  }
}

}  // namespace nacre::factor::internal
