#include "factor/internal/measure.h"

#include "core/parallel.h"
#include "core/rank_shares.h"
#include "factor/internal/equal_rows.h"
#include "factor/internal/material_codes.h"
#include "factor/internal/reciprocal.h"
#include "factor/internal/reciprocal_sums.h"
#include "factor/internal/window_totals.h"
#include "reconstruct/error_figures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

namespace nacre::factor::internal {
namespace {

constexpr float kMostSteps = 0x1p24F;
constexpr float kMostHalf = 65504;

// The errors of one slice, or of all that are equal to it.
struct SliceFit {
  std::int64_t slices = 1;
  FitError error;
  double worst_channel = 0;
  double worst_total = 0;
  std::int64_t unfit = 0;
};

FitError ErrorOf(std::span<const float> rd,
                 std::span<const std::uint8_t> valid,
                 std::span<const float> modelled,
                 double floor) {
  FitError error;
  for (std::size_t cell = 0; cell < rd.size(); ++cell) {
    if (valid[cell] != 0) {
      error.Add(
          static_cast<double>(rd[cell]), static_cast<double>(modelled[cell]), floor);
    }
  }
  return error;
}

float RoundScale(double scale, float step) {
  const auto value = static_cast<float>(scale);
  return step > 0 ? std::min(std::nearbyint(value / step), kMostSteps) * step : value;
}

float RoundAlbedo(double albedo, bool rounded) {
  const auto value = static_cast<float>(albedo);
  return rounded && value <= kMostHalf ? RoundToHalf(value) : value;
}

// Sets row_scale and albedo of one slice and channel; `window` returns its values.
void ScaleSlice(std::span<const float> rd,
                std::span<const std::uint8_t> valid,
                std::int64_t point,
                std::size_t channel,
                Material& m,
                std::span<float> window) {
  const auto c = static_cast<int>(channel);
  const GridIndex index{static_cast<int>(point % m.points_x),
                        static_cast<int>(point / m.points_x)};
  if (m.form == Form::kReciprocal) {
    m.EvaluateWindow(c, index.x, index.y, window.data());
  } else {
    m.EvaluateTerms(c, index.x, index.y, m.terms, window.data());
  }
  const auto at = static_cast<std::size_t>(std::int64_t{c} * m.PointCount() + point);
  if (m.KeepsTotals()) {
    m.row_scale[at] = RoundScale(TotalScale(rd, valid, window), m.steps.row_scale);
  }
  if (m.form != Form::kReciprocal) {
    for (float& value : window) {
      value *= m.row_scale[at];
    }
  }
  const double total = std::accumulate(window.begin(), window.end(), 0.0);
  m.albedo[at] = RoundAlbedo(total * m.pitch_mm * m.pitch_mm, !m.steps.empty());
}

// `row_of` gives the slice that a fit is of.
template <class RowOf>
void Summarize(const Job& job,
               const std::vector<SliceFit>& fits,
               const RowOf& row_of,
               const Material& m,
               FactorSummary& summary) {
  FitError sum;
  std::int64_t slices = 0;
  summary.unfit_slices = 0;
  summary.worst_slice = 0;
  summary.worst_total = 0;
  for (std::size_t n = 0; n < fits.size(); ++n) {
    sum += fits[n].error;
    slices += fits[n].slices;
    summary.worst_total = std::max(summary.worst_total, fits[n].worst_total);
    summary.unfit_slices += fits[n].unfit;
    if (fits[n].worst_channel > summary.worst_slice) {
      summary.worst_slice = fits[n].worst_channel;
      summary.worst_slice_i = static_cast<int>(row_of(n) % m.points_x);
      summary.worst_slice_j = static_cast<int>(row_of(n) / m.points_x);
    }
  }
  const auto cells = static_cast<double>(m.PointCount() * m.WindowSize()) *
                     static_cast<double>(m.channels.size());
  summary.relative_l2 = sum.RelativeL2();
  summary.rmse_over_mean = sum.RmseOverMean();
  summary.log_rms = sum.LogRms();
  summary.peak = job.Peak();
  const double rmse = sum.Rmse();
  summary.psnr_db = rmse > 0 && summary.peak > 0
                        ? 20 * std::log10(summary.peak / rmse)
                        : std::numeric_limits<double>::infinity();
  summary.measured_slices = slices;
  summary.missing_fraction =
      1 - static_cast<double>(sum.used) / (cells * static_cast<double>(slices) /
                                           static_cast<double>(m.PointCount()));
  summary.dataset_bytes = static_cast<std::int64_t>(cells * sizeof(float));
  summary.terms = m.terms;
  summary.clusters = m.cluster_count;
}

// How far a slice's total is off, once scaled to steps.
void AddTotal(double measured, double modelled, SliceFit& fit) {
  if (measured > 0 && modelled > 0) {
    fit.worst_total = std::max(fit.worst_total, std::abs(modelled / measured - 1));
  } else if (measured != 0 || modelled != 0) {
    ++fit.unfit;
  }
}

// Of their totals.
SliceFit WorstOf(const std::vector<SliceFit>& fits) {
  SliceFit all;
  for (const SliceFit& fit : fits) {
    all.worst_total = std::max(all.worst_total, fit.worst_total);
    all.unfit += fit.unfit;
  }
  return all;
}

// Albedo of all slices of a reciprocal material, and how far their totals are off.
SliceFit SumAll(const Job& job, Material& m) {
  const std::vector<double> totals = ReciprocalTotals(m, WorkersOf(job));
  SliceFit all;
  for (std::size_t at = 0; at < totals.size(); ++at) {
    m.albedo[at] = RoundAlbedo(totals[at] * m.pitch_mm * m.pitch_mm, !m.steps.empty());
    AddTotal(job.totals[at], totals[at], all);
  }
  return all;
}

// row_scale and albedo of all slices by the totals that the fit left.
SliceFit ScaleAll(const Job& job, Material& m) {
  constexpr std::int64_t kBlock = 256;
  const std::int64_t points = m.PointCount();
  const std::int64_t blocks = (points + kBlock - 1) / kBlock;
  std::vector<SliceFit> fits(m.channels.size() * static_cast<std::size_t>(blocks));
  ParallelFor(std::ssize(fits), job.options.thread_count, [&](std::int64_t task) {
    const auto channel = static_cast<int>(task / blocks);
    const std::int64_t first = task % blocks * kBlock;
    const std::int64_t count = std::min(kBlock, points - first);
    std::array<double, kBlock> totals{};
    WindowTotals(m, channel, first, count, totals.data());
    for (std::int64_t n = 0; n < count; ++n) {
      const auto at = static_cast<std::size_t>(channel * points + first + n);
      const double modelled = totals[static_cast<std::size_t>(n)];
      const double scale = modelled > 0 ? std::max(0.0, job.totals[at] / modelled) : 1;
      m.row_scale[at] = RoundScale(scale, m.steps.row_scale);
      const double scaled = modelled * static_cast<double>(m.row_scale[at]);
      m.albedo[at] = RoundAlbedo(scaled * m.pitch_mm * m.pitch_mm, !m.steps.empty());
      AddTotal(job.totals[at], scaled, fits[static_cast<std::size_t>(task)]);
    }
  });
  return WorstOf(fits);
}

// Totals are those of all slices; errors are measured on some.
void MeasureCheck(Job& job, Material& m, FactorSummary& summary) {
  const SliceFit all = m.form == Form::kReciprocal ? SumAll(job, m) : ScaleAll(job, m);
  const auto window = static_cast<std::size_t>(m.WindowSize());
  const double floor = reconstruct::kLogFloor * job.Peak();
  const reconstruct::RdDataset& data = job.check.dataset;
  const RankShare share = ShareOf(std::ssize(job.check.rows), job.options.ranks);
  const std::int64_t own = share.end - share.begin;
  std::vector<SliceFit> fits(job.check.rows.size());
  ParallelFor(own, job.options.thread_count, [&](std::int64_t n) {
    const auto r = static_cast<std::size_t>(share.begin + n);
    SliceFit& fit = fits[r];
    const std::int64_t point = job.check.rows[r];
    std::vector<float> windows(window * m.channels.size());
    const GridIndex index{static_cast<int>(point % m.points_x),
                          static_cast<int>(point / m.points_x)};
    if (m.form == Form::kReciprocal) {
      ScaledReciprocalWindows(m, index, windows.data());
    }
    for (std::size_t c = 0; c < m.channels.size(); ++c) {
      const std::span values(&windows[c * window], window);
      if (m.form != Form::kReciprocal) {
        m.EvaluateWindow(static_cast<int>(c), index.x, index.y, values.data());
      }
      const std::size_t offset = (r * m.channels.size() + c) * window;
      const FitError error = ErrorOf(
          {&data.rd[offset], window}, {&data.valid[offset], window}, values, floor);
      fit.error += error;
      fit.worst_channel = std::max(fit.worst_channel, error.RelativeL2());
    }
  });
  JoinShares(std::ssize(fits), job.options.ranks, std::span(fits));
  Summarize(
      job, fits, [&](std::size_t n) { return job.check.rows[n]; }, m, summary);
  summary.worst_total = all.worst_total;
  summary.unfit_slices = all.unfit;
}

// Collective: what each rank found of its slices is in all of them.
void JoinMeasured(const Ranks* ranks, std::vector<SliceFit>& fits, Material& m) {
  const auto points = static_cast<std::size_t>(m.PointCount());
  JoinShares(m.PointCount(), ranks, std::span(fits));
  for (std::size_t c = 0; c < m.channels.size(); ++c) {
    for (std::vector<float>* values : {&m.row_scale, &m.albedo}) {
      JoinShares(m.PointCount(), ranks, std::span(*values).subspan(c * points, points));
    }
  }
}

}  // namespace

void Measure(Job& job, Material& m, FactorSummary& summary) {
  if (!job.totals.empty()) {
    MeasureCheck(job, m, summary);
    return;
  }
  SliceSource& source = job.distinct != nullptr ? *job.distinct : job.source;
  const EqualRows* equal = job.distinct != nullptr ? &job.distinct->rows() : nullptr;
  const auto point_of = [&](std::int64_t row) {
    return equal != nullptr ? equal->first[static_cast<std::size_t>(row)] : row;
  };
  const std::int64_t points = source.header().PointCount();
  const auto window = static_cast<std::size_t>(m.WindowSize());
  const double floor = reconstruct::kLogFloor * job.Peak();
  std::vector<SliceFit> fits(static_cast<std::size_t>(points));
  // Of distinct slices there are few, and their places are anywhere.
  const RankShare share =
      equal != nullptr ? RankShare{0, points} : ShareOf(points, job.options.ranks);
  for (std::int64_t first = share.begin; first < share.end; first += kBlockRows) {
    Report(job.progress, {"factor", first, points, "errors"});
    const SliceBlock block =
        source.Read(first, std::min(kBlockRows, share.end - first));
    ParallelFor(block.count, job.options.thread_count, [&](std::int64_t row) {
      SliceFit& fit = fits[static_cast<std::size_t>(first + row)];
      std::vector<float> values(window);
      for (std::size_t c = 0; c < m.channels.size(); ++c) {
        const std::size_t offset =
            (static_cast<std::size_t>(row) * m.channels.size() + c) * window;
        const std::span rd(block.rd + offset, window);
        const std::span valid(block.valid + offset, window);
        ScaleSlice(rd, valid, point_of(first + row), c, m, values);
        const FitError error = ErrorOf(rd, valid, values, floor);
        fit.error += error;
        fit.worst_channel = std::max(fit.worst_channel, error.RelativeL2());
        AddTotal(error.signal, error.model, fit);
      }
      if (block.weight != nullptr) {
        fit.slices = block.weight[row];
        fit.error.Repeat(fit.slices);
        fit.unfit *= fit.slices;
      }
    });
  }
  Report(job.progress, {"factor", points, points, "done"});
  if (equal != nullptr) {
    CopyFromFirst(*equal, m.row_scale);
    CopyFromFirst(*equal, m.albedo);
  } else {
    ++job.passes;
    JoinMeasured(job.options.ranks, fits, m);
  }
  Summarize(
      job,
      fits,
      [&](std::size_t n) { return point_of(static_cast<std::int64_t>(n)); },
      m,
      summary);
}

FitError SampleError(const Job& job, const Material& m) {
  const auto window = static_cast<std::size_t>(m.WindowSize());
  const std::size_t channels = m.channels.size();
  const double floor = reconstruct::kLogFloor * job.Peak();
  const reconstruct::RdDataset& data = job.sample.dataset;
  std::vector<FitError> errors(job.sample.rows.size());
  const RankShare share = ShareOf(std::ssize(errors), job.options.ranks);
  const std::int64_t own = share.end - share.begin;
  ParallelFor(own, job.options.thread_count, [&](std::int64_t n) {
    const auto r = static_cast<std::size_t>(share.begin + n);
    const auto i = static_cast<int>(job.sample.rows[r] % m.points_x);
    const auto j = static_cast<int>(job.sample.rows[r] / m.points_x);
    std::vector<float> values(window);
    for (std::size_t c = 0; c < channels; ++c) {
      m.EvaluateTerms(static_cast<int>(c), i, j, m.terms, values.data());
      const std::size_t offset = (r * channels + c) * window;
      const std::span rd(&data.rd[offset], window);
      const std::span valid(&data.valid[offset], window);
      if (m.KeepsTotals()) {
        const auto scale = static_cast<float>(TotalScale(rd, valid, values));
        for (float& value : values) {
          value *= scale;
        }
      }
      errors[r] += ErrorOf(rd, valid, values, floor);
    }
  });
  JoinShares(std::ssize(errors), job.options.ranks, std::span(errors));
  FitError sum;
  for (const FitError& error : errors) {
    sum += error;
  }
  return sum;
}

double TotalScale(std::span<const float> rd,
                  std::span<const std::uint8_t> valid,
                  std::span<const float> modelled) {
  double measured_total = 0;
  double modelled_total = 0;
  for (std::size_t cell = 0; cell < rd.size(); ++cell) {
    if (valid[cell] != 0) {
      measured_total += static_cast<double>(rd[cell]);
      modelled_total += static_cast<double>(modelled[cell]);
    }
  }
  return modelled_total > 0 ? std::max(0.0, measured_total / modelled_total) : 1;
}

}  // namespace nacre::factor::internal
