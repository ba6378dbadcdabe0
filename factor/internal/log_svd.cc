// The SVD model of [Kurt14; Oenel14, sec. 4.3]: R'_d is transformed, cut after S terms
// of its singular value decomposition, a channel at a time. Where the thesis takes the
// terms one by one from the residual, all S come from one decomposition here, which is
// the same by Eckart and Young's theorem.

#include "factor/internal/log_svd.h"

#include "core/parallel.h"
#include "factor/internal/method.h"

#include <algorithm>
#include <cmath>

namespace nacre::factor::internal {
namespace {

constexpr Eigen::Index kPanelColumns = 64;

// A block's rows of one channel, transformed, one matrix a cluster.
using ClusterRows = std::vector<RowMatrix>;

class GramPass {
 public:
  GramPass(SliceSource& source, const SvdFitOptions& options, const SvdModel& model)
      : source_(source),
        options_(options),
        model_(model),
        window_(source.header().WindowSize()),
        sums_(model.scans.size() * static_cast<std::size_t>(options.cluster_count),
              GramSum(window_)),
        missing_(model.scans.size(), 0) {}

  // Returns whether some value was missing.
  bool Run(const ProgressFunction& progress, const std::string& note) {
    const std::int64_t points = source_.header().PointCount();
    for (std::int64_t first = 0; first < points; first += kBlockRows) {
      Report(progress, {"factor", first, points, note});
      AddBlock(source_.Read(first, std::min(kBlockRows, points - first)));
    }
    return std::any_of(missing_.begin(), missing_.end(), [](int n) { return n > 0; });
  }

  const std::vector<GramSum>& sums() const { return sums_; }

 private:
  void AddBlock(const SliceBlock& block) {
    const auto channels = static_cast<std::int64_t>(model_.scans.size());
    std::vector<ClusterRows> rows(model_.scans.size());
    for (std::size_t c = 0; c < rows.size(); ++c) {
      Transform(block, c, rows[c]);
    }
    FindWeights(block);
    const std::int64_t clusters = options_.cluster_count;
    const std::int64_t panels = (window_ + kPanelColumns - 1) / kPanelColumns;
    ParallelFor(
        channels * clusters * panels, options_.thread_count, [&](std::int64_t t) {
          const auto sum_index = static_cast<std::size_t>(t / panels);
          const RowMatrix& y = rows[sum_index / static_cast<std::size_t>(clusters)]
                                   [sum_index % static_cast<std::size_t>(clusters)];
          if (y.rows() > 0) {
            const Eigen::Index first = (t % panels) * kPanelColumns;
            sums_[sum_index].AddPanel(
                y,
                weights_[sum_index % static_cast<std::size_t>(clusters)],
                first,
                std::min(kPanelColumns, window_ - first));
          }
        });
  }

  void Transform(const SliceBlock& block, std::size_t channel, ClusterRows& rows) {
    // Rows of a cluster keep their order.
    std::vector<Eigen::Index> count(static_cast<std::size_t>(options_.cluster_count),
                                    0);
    std::vector<Eigen::Index> place(static_cast<std::size_t>(block.count));
    for (std::int64_t row = 0; row < block.count; ++row) {
      place[static_cast<std::size_t>(row)] = count[ClusterOf(block, row)]++;
    }
    for (const Eigen::Index n : count) {
      rows.emplace_back(n, window_);
    }
    std::vector<int> missing(static_cast<std::size_t>(block.count), 0);
    ParallelFor(block.count, options_.thread_count, [&](std::int64_t row) {
      const auto r = static_cast<std::size_t>(row);
      RowMatrix& y = rows[ClusterOf(block, row)];
      missing[r] = CompleteRow(model_,
                               block,
                               row,
                               channel,
                               {&y(place[r], 0), static_cast<std::size_t>(window_)});
    });
    for (const int n : missing) {
      missing_[channel] = std::max(missing_[channel], n);
    }
  }

  // How often each row of a cluster counts.
  void FindWeights(const SliceBlock& block) {
    std::vector<std::vector<double>> weights(
        static_cast<std::size_t>(options_.cluster_count));
    for (std::int64_t row = 0; row < block.count; ++row) {
      weights[ClusterOf(block, row)].push_back(
          block.weight == nullptr ? 1 : static_cast<double>(block.weight[row]));
    }
    weights_.clear();
    for (const std::vector<double>& of : weights) {
      weights_.push_back(Eigen::Map<const Eigen::VectorXd>(of.data(), std::ssize(of)));
    }
  }

  std::size_t ClusterOf(const SliceBlock& block, std::int64_t row) const {
    return model_.cluster[static_cast<std::size_t>(block.first + row)];
  }

  SliceSource& source_;
  const SvdFitOptions& options_;
  const SvdModel& model_;
  Eigen::Index window_;
  std::vector<GramSum> sums_;
  std::vector<Eigen::VectorXd> weights_;  // of a block's rows, [cluster]
  std::vector<int> missing_;
};

}  // namespace

int CompleteRow(const SvdModel& model,
                const SliceBlock& block,
                std::int64_t row,
                std::size_t channel,
                std::span<double> values) {
  const std::size_t window = values.size();
  const auto offset =
      (static_cast<std::size_t>(row) * model.scans.size() + channel) * window;
  const std::span<const std::uint8_t> valid(block.valid + offset, window);
  const RowTransform& transform = model.transforms[channel];
  const ChannelScan& scan = model.scans[channel];
  const int missing =
      TransformRow({block.rd + offset, window}, valid, scan, transform, values);
  if (missing == 0 || model.bases.empty()) {
    return missing;
  }
  const RowBasis& basis = model.Basis(channel, block.first + row);
  const Eigen::VectorXd predicted =
      basis.vectors * basis.PartialCoordinates(values, valid);
  // Predictions stay within what was measured anywhere in the channel.
  for (std::size_t cell = 0; cell < window; ++cell) {
    if (valid[cell] == 0) {
      const double g = scan.falloff.empty() ? 1 : scan.falloff[cell];
      values[cell] = std::clamp(predicted(static_cast<Eigen::Index>(cell)),
                                transform.Forward(std::min(0.0, scan.least) / g),
                                transform.Forward(std::max(0.0, scan.peak) / g));
    }
  }
  return missing;
}

void FitByGram(SliceSource& source,
               const SvdFitOptions& options,
               SvdModel& model,
               const ProgressFunction& progress) {
  for (int round = 0; round <= options.fill_rounds; ++round) {
    GramPass pass(source, options, model);
    const bool has_missing = pass.Run(progress, round == 0 ? "sums" : "missing values");
    ++model.passes;
    std::vector<RowBasis> bases(pass.sums().size());
    ParallelFor(static_cast<std::int64_t>(bases.size()),
                options.thread_count,
                [&](std::int64_t n) {
                  const auto k = static_cast<std::size_t>(n);
                  bases[k] = BasisOf(pass.sums()[k], options.terms, options.one_by_one);
                });
    model.bases = std::move(bases);
    if (!has_missing) {
      break;
    }
  }
}

int TransformRow(std::span<const float> rd,
                 std::span<const std::uint8_t> valid,
                 const ChannelScan& scan,
                 const RowTransform& transform,
                 std::span<double> row) {
  const int missing = FillRow(rd, valid, scan, row);
  for (std::size_t cell = 0; cell < scan.falloff.size(); ++cell) {
    row[cell] /= scan.falloff[cell];
  }
  for (double& value : row) {
    value = transform.Forward(value);
  }
  return missing;
}

Eigen::VectorXd RowCoordinates(const RowBasis& basis,
                               std::span<const double> row,
                               std::span<const std::uint8_t> valid,
                               int missing) {
  return missing == 0 ? basis.Coordinates(row) : basis.PartialCoordinates(row, valid);
}

Material ToMaterial(const SvdModel& model,
                    const reconstruct::RdHeader& header,
                    int terms) {
  const std::size_t channels = header.channels.size();
  const auto points = static_cast<std::size_t>(header.PointCount());
  const auto window = static_cast<std::size_t>(header.WindowSize());
  Material m = EmptyMaterial(header);
  const RowTransform& first = model.transforms[0];
  m.transform = first.is_log    ? Transform::kLog
                : first.is_root ? Transform::kSqrt
                                : Transform::kLinear;
  m.terms = terms;
  m.cluster_count = model.cluster_count;
  m.cluster = model.cluster;
  m.f.assign(channels * static_cast<std::size_t>(terms) * points, 0.0F);
  m.h.assign(model.bases.size() * static_cast<std::size_t>(terms) * window, 0.0F);
  const auto clusters = static_cast<std::size_t>(model.cluster_count);
  for (std::size_t c = 0; c < channels; ++c) {
    const RowTransform& transform = model.transforms[c];
    if (transform.is_log) {
      m.a[c] = transform.a;
      m.b[c] = transform.b;
    }
    for (std::size_t k = 0; k < clusters; ++k) {
      const RowBasis& basis = model.bases[c * clusters + k];
      const double unit = transform.is_log    ? 1
                          : transform.is_root ? std::sqrt(transform.a)
                                              : transform.a;
      const double scale = unit / std::sqrt(static_cast<double>(basis.rows));
      for (Eigen::Index j = 0; j < std::min<Eigen::Index>(terms, basis.rank()); ++j) {
        const std::size_t at = ((c * clusters + k) * static_cast<std::size_t>(terms) +
                                static_cast<std::size_t>(j)) *
                               window;
        const std::vector<double>& falloff = model.scans[c].falloff;
        for (std::size_t cell = 0; cell < window; ++cell) {
          const double g = falloff.empty() ? 1 : falloff[cell];
          m.h[at + cell] = static_cast<float>(
              basis.vectors(static_cast<Eigen::Index>(cell), j) * basis.sigma(j) *
              scale * (transform.is_root ? std::sqrt(g) : g));
        }
      }
    }
  }
  return m;
}

void ProjectSlice(const SvdModel& model,
                  const SliceBlock& block,
                  std::int64_t row,
                  std::size_t channel,
                  Material& material) {
  const auto size = static_cast<std::size_t>(material.WindowSize());
  const auto offset =
      (static_cast<std::size_t>(row) * material.channels.size() + channel) * size;
  const std::span<const float> rd(block.rd + offset, size);
  const std::span<const std::uint8_t> valid(block.valid + offset, size);
  const std::int64_t point = block.first + row;
  const RowBasis& basis = model.Basis(channel, point);

  std::vector<double> y(size);
  const int missing =
      TransformRow(rd, valid, model.scans[channel], model.transforms[channel], y);
  const Eigen::VectorXd coordinates = RowCoordinates(basis, y, valid, missing);
  const auto c = static_cast<int>(channel);
  const double root_rows = std::sqrt(static_cast<double>(basis.rows));
  for (int j = 0; j < std::min(material.terms, static_cast<int>(basis.rank())); ++j) {
    material.f[static_cast<std::size_t>(
        (std::int64_t{c} * material.terms + j) * material.PointCount() + point)] =
        static_cast<float>(coordinates(j) / basis.sigma(j) * root_rows);
  }
}

}  // namespace nacre::factor::internal
