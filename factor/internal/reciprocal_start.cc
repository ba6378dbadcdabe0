// What the maps of a reciprocal model begin with.

#include "core/parallel.h"
#include "factor/internal/reciprocal_data.h"
#include "factor/internal/truncated_svd.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace nacre::factor::internal {
namespace {

constexpr double kLeastShare = 0.02;  // of the mean: logarithms stop there

// Logarithms of slices over the mean slice's, with weights that make their error that
// of R_d over its tolerance. What wasn't measured is as the mean.
class LogRows {
 public:
  LogRows(const ReciprocalData& data, const reconstruct::RdHeader& header)
      : window_(static_cast<std::size_t>(header.WindowSize())) {
    for (std::size_t c = 0; c < data.channels; ++c) {
      for (std::size_t cell = 0; cell < window_; ++cell) {
        const std::size_t n = c * data.cells + std::min(cell, window_ - 1 - cell);
        const double mean = std::max(data.mean[n], 1e-12);
        const double noise = data.noise[n];
        cells_.push_back(
            {data.scale[c] * mean,
             std::max(2 * noise / mean, kLeastShare),
             mean / std::sqrt(noise * noise + Tolerance(mean, data.tail_weight))});
      }
    }
  }

  void Make(const float* rd, const std::uint8_t* valid, double* row) const {
    for (std::size_t n = 0; n < cells_.size(); ++n) {
      const Cell& cell = cells_[n];
      row[n] =
          valid[n] == 0
              ? 0
              : cell.weight * std::log(std::max(static_cast<double>(rd[n]) / cell.mean,
                                                cell.least));
    }
  }

 private:
  struct Cell {
    double mean;   // mm⁻²
    double least;  // means
    double weight;
  };
  std::size_t window_;
  std::vector<Cell> cells_;
};

}  // namespace

struct StartingMaps::State {
  const ReciprocalData& data;
  const reconstruct::RdHeader& header;
  int thread_count;
  LogRows rows;
  Eigen::RowVectorXd mean;
  Eigen::MatrixXd basis;
  SharedMaps maps;
};

StartingMaps::~StartingMaps() = default;

StartingMaps::StartingMaps(const Job& job, const ReciprocalData& data, int terms)
    : state_(new State{data,
                       job.source.header(),
                       job.options.thread_count,
                       LogRows(data, job.source.header()),
                       {},
                       {},
                       {}}) {
  State& s = *state_;
  const reconstruct::RdDataset& sample = job.sample.dataset;
  RowMatrix y(std::ssize(job.sample.rows), s.header.SliceSize());
  for (Eigen::Index row = 0; row < y.rows(); ++row) {
    const auto at = static_cast<std::size_t>(row * s.header.SliceSize());
    s.rows.Make(&sample.rd[at], &sample.valid[at], &y(row, 0));
  }
  s.mean = y.colwise().mean();
  y.rowwise() -= s.mean;
  s.basis = y.cwiseAbs().maxCoeff() > 1e-9 ? ComputeTruncatedSvd(y, terms).basis
                                           : Eigen::MatrixXd(y.cols(), 0);
  s.maps = SharedMaps::Zero(std::max<Eigen::Index>(s.basis.cols(), 1),
                            static_cast<Eigen::Index>(data.Plane()));
}

void StartingMaps::Add(const SliceBlock& block) {
  State& s = *state_;
  if (s.basis.cols() == 0) {
    return;
  }
  ParallelFor(block.count, s.thread_count, [&](std::int64_t row) {
    Eigen::VectorXd slice(s.header.SliceSize());
    const std::int64_t at = row * s.header.SliceSize();
    s.rows.Make(block.rd + at, block.valid + at, slice.data());
    const std::int64_t point = block.first + row;
    const std::int64_t to = (point / s.header.points_x + s.data.margin) * s.data.width +
                            point % s.header.points_x + s.data.margin;
    s.maps.col(to) = (s.basis.transpose() * (slice - s.mean.transpose())).cast<float>();
  });
}

SharedMaps StartingMaps::Finish() {
  const ReciprocalData& data = state_->data;
  ExtendMaps(data.width, data.height, data.margin, state_->maps);
  return std::move(state_->maps);
}

}  // namespace nacre::factor::internal
