#include "factor/internal/projection.h"

#include "core/parallel.h"
#include "factor/internal/fit_error.h"
#include "factor/internal/measure.h"
#include "reconstruct/error_figures.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace nacre::factor::internal {

namespace {

// The fit's own coordinates, without another pass.
void StoreScores(const SvdModel& model, Material& m) {
  const auto points = static_cast<std::size_t>(m.PointCount());
  for (std::size_t c = 0; c < model.scores.size(); ++c) {
    const RowBasis& basis = model.bases[c];
    const auto rank = static_cast<std::size_t>(basis.rank());
    const auto terms = static_cast<std::size_t>(m.terms);
    for (std::size_t j = 0; j < std::min(terms, rank); ++j) {
      const double scale = std::sqrt(static_cast<double>(basis.rows)) /
                           basis.sigma(static_cast<Eigen::Index>(j));
      float* map = &m.f[(c * terms + j) * points];
      for (std::size_t point = 0; point < points; ++point) {
        map[point] = static_cast<float>(
            static_cast<double>(model.scores[c][point * rank + j]) * scale);
      }
    }
  }
}

struct ScaleAndFloor {
  double scale;  // of the model's values
  double floor;  // of the logarithm
};

void AddErrors(std::span<const float> rd,
               std::span<const std::uint8_t> valid,
               std::span<const float> values,
               ScaleAndFloor figures,
               FitError& error) {
  for (std::size_t cell = 0; cell < rd.size(); ++cell) {
    if (valid[cell] != 0) {
      error.Add(static_cast<double>(rd[cell]),
                static_cast<double>(values[cell]) * figures.scale,
                figures.floor);
    }
  }
}

}  // namespace

Material Project(Job& job, const SvdModel& model, int terms) {
  Material material = ToMaterial(model, job.source.header(), terms);
  if (!model.scores.empty()) {
    StoreScores(model, material);
    return material;
  }
  const std::int64_t points = material.PointCount();
  for (std::int64_t first = 0; first < points; first += kBlockRows) {
    Report(job.progress, {"factor", first, points, "projection"});
    const SliceBlock block =
        job.source.Read(first, std::min(kBlockRows, points - first));
    ParallelFor(block.count, job.options.thread_count, [&](std::int64_t row) {
      for (std::size_t c = 0; c < material.channels.size(); ++c) {
        ProjectSlice(model, block, row, c, material);
      }
    });
  }
  ++job.passes;
  return material;
}

std::vector<TermsError> ErrorCurve(const Job& job, const SvdModel& model, int terms) {
  SvdModel sampled = model;
  sampled.scores.clear();
  sampled.cluster.clear();
  for (const std::int64_t row : job.sample.rows) {
    sampled.cluster.push_back(model.cluster[static_cast<std::size_t>(row)]);
  }
  const reconstruct::RdDataset& sample = job.sample.dataset;
  const std::int64_t count = std::ssize(job.sample.rows);
  const auto window = static_cast<std::size_t>(sample.header.WindowSize());
  const auto channels = static_cast<std::int64_t>(sample.header.channels.size());
  const SliceBlock block{0, count, sample.rd.data(), sample.valid.data()};
  const double floor = reconstruct::kLogFloor * job.Peak();
  Material material = ToMaterial(sampled, sample.header, terms);
  std::vector<FitError> errors(static_cast<std::size_t>(count * terms));
  ParallelFor(count, job.options.thread_count, [&](std::int64_t row) {
    std::vector<float> values(window);
    for (std::int64_t c = 0; c < channels; ++c) {
      ProjectSlice(sampled, block, row, static_cast<std::size_t>(c), material);
      const std::size_t offset = static_cast<std::size_t>(row * channels + c) * window;
      for (int n = 1; n <= terms; ++n) {
        material.EvaluateTerms(
            static_cast<int>(c), static_cast<int>(row), 0, n, values.data());
        const double scale = TotalScale(
            {&sample.rd[offset], window}, {&sample.valid[offset], window}, values);
        AddErrors({&sample.rd[offset], window},
                  {&sample.valid[offset], window},
                  values,
                  {scale, floor},
                  errors[static_cast<std::size_t>(row * terms + n - 1)]);
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
