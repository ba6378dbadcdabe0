#include "factor/internal/projection.h"

#include "core/parallel.h"
#include "reconstruct/error_figures.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace nacre::factor::internal {

double GlobalPeak(const SvdModel& model) {
  double peak = 0;
  for (const ChannelScan& scan : model.scans) {
    peak = std::max(peak, scan.peak);
  }
  return peak;
}

Material Projection::Run(int terms,
                         const ProgressFunction& progress,
                         FactorSummary& summary) {
  Material material = ToMaterial(model_, source_.header(), terms);
  const std::int64_t points = material.PointCount();
  fits_.assign(static_cast<std::size_t>(points), {});
  for (std::int64_t first = 0; first < points; first += kBlockRows) {
    Report(progress, {"factor", first, points, "projection"});
    const SliceBlock block = source_.Read(first, std::min(kBlockRows, points - first));
    ParallelFor(block.count, thread_count_, [&](std::int64_t row) {
      ProjectRow(block, row, material);
    });
  }
  Report(progress, {"factor", points, points, "done"});
  Summarize(material, summary);
  return material;
}

void Projection::ProjectRow(const SliceBlock& block,
                            std::int64_t row,
                            Material& material) {
  const auto window = static_cast<std::size_t>(material.WindowSize());
  const double floor = reconstruct::kLogFloor * GlobalPeak(model_);
  SliceFit& fit = fits_[static_cast<std::size_t>(block.first + row)];
  std::vector<float> values;
  for (std::size_t c = 0; c < material.channels.size(); ++c) {
    ProjectSlice(model_, block, row, c, material, values);
    const std::size_t offset =
        (static_cast<std::size_t>(row) * material.channels.size() + c) * window;
    FitError error;
    for (std::size_t cell = 0; cell < window; ++cell) {
      if (block.valid[offset + cell] != 0) {
        error.Add(static_cast<double>(block.rd[offset + cell]),
                  static_cast<double>(values[cell]),
                  floor);
      }
    }
    fit.error += error;
    fit.worst_channel = std::max(fit.worst_channel, error.RelativeL2());
    if (error.signal > 0 && error.model > 0) {
      fit.worst_total =
          std::max(fit.worst_total, std::abs(error.model / error.signal - 1));
    } else if (error.signal != 0 || error.model != 0) {
      ++fit.unfit;
    }
  }
}

void Projection::Summarize(const Material& material, FactorSummary& summary) const {
  FitError sum;
  summary.unfit_slices = 0;
  summary.worst_slice = 0;
  summary.worst_total = 0;
  for (std::size_t n = 0; n < fits_.size(); ++n) {
    sum += fits_[n].error;
    summary.worst_total = std::max(summary.worst_total, fits_[n].worst_total);
    summary.unfit_slices += fits_[n].unfit;
    if (fits_[n].worst_channel > summary.worst_slice) {
      summary.worst_slice = fits_[n].worst_channel;
      summary.worst_slice_i = static_cast<int>(n) % material.points_x;
      summary.worst_slice_j = static_cast<int>(n) / material.points_x;
    }
  }
  const auto cells =
      static_cast<double>(material.PointCount() * material.WindowSize()) *
      static_cast<double>(material.channels.size());
  summary.relative_l2 = sum.RelativeL2();
  summary.rmse_over_mean = sum.RmseOverMean();
  summary.log_rms = sum.LogRms();
  summary.peak = GlobalPeak(model_);
  const double rmse = sum.Rmse();
  summary.psnr_db = rmse > 0 && summary.peak > 0
                        ? 20 * std::log10(summary.peak / rmse)
                        : std::numeric_limits<double>::infinity();
  summary.missing_fraction = 1 - static_cast<double>(sum.used) / cells;
  summary.bytes = material.StorageBytes();
  summary.dataset_bytes = static_cast<std::int64_t>(cells * sizeof(float));
  summary.terms = material.terms;
  summary.clusters = material.cluster_count;
}

// What 1, 2, … terms would give, on the sampled slices.
std::vector<TermsError> ErrorCurve(const SvdModel& model,
                                   const reconstruct::RdDataset& sample,
                                   const std::vector<std::int64_t>& rows,
                                   int terms,
                                   int thread_count) {
  SvdModel sampled = model;
  sampled.cluster.clear();
  for (const std::int64_t row : rows) {
    sampled.cluster.push_back(model.cluster[static_cast<std::size_t>(row)]);
  }
  const auto count = static_cast<std::int64_t>(rows.size());
  const auto window = static_cast<std::size_t>(sample.header.WindowSize());
  const auto channels = static_cast<std::int64_t>(sample.header.channels.size());
  const SliceBlock block{0, count, sample.rd.data(), sample.valid.data()};
  const double floor = reconstruct::kLogFloor * GlobalPeak(model);
  Material material = ToMaterial(sampled, sample.header, terms);
  std::vector<FitError> errors(static_cast<std::size_t>(count * terms));
  ParallelFor(count, thread_count, [&](std::int64_t row) {
    std::vector<float> values(window);
    for (std::int64_t c = 0; c < channels; ++c) {
      const auto channel = static_cast<std::size_t>(c);
      ProjectSlice(sampled, block, row, channel, material, values);
      const std::size_t offset = static_cast<std::size_t>(row * channels + c) * window;
      for (int n = 1; n <= terms; ++n) {
        material.EvaluateTerms(
            static_cast<int>(c), static_cast<int>(row), 0, n, values.data());
        const double scale = TotalScale(
            {&sample.rd[offset], window}, {&sample.valid[offset], window}, values);
        FitError& error = errors[static_cast<std::size_t>(row * terms + n - 1)];
        for (std::size_t cell = 0; cell < window; ++cell) {
          if (sample.valid[offset + cell] != 0) {
            error.Add(static_cast<double>(sample.rd[offset + cell]),
                      static_cast<double>(values[cell]) * scale,
                      floor);
          }
        }
      }
    }
  });
  std::vector<TermsError> curve;
  for (int n = 1; n <= terms; ++n) {
    FitError sum;
    for (std::int64_t row = 0; row < count; ++row) {
      sum += errors[static_cast<std::size_t>(row * terms + n - 1)];
    }
    curve.push_back({n, sum.RelativeL2(), sum.LogRms()});
  }
  return curve;
}

}  // namespace nacre::factor::internal
