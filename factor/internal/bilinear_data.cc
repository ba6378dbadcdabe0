#include "factor/internal/bilinear_data.h"

#include "core/parallel.h"
#include "factor/internal/truncated_svd.h"
#include "reconstruct/error_figures.h"

#include <algorithm>
#include <cmath>

namespace nacre::factor::internal {
namespace {

// What noise alone may come to, mm⁻².
double NoiseFloor(const Job& job) {
  double least = 0;
  for (const ChannelScan& scan : job.scans) {
    least = std::min(least, scan.least);
  }
  return -0.5 * least;
}

// A slice of all channels, missing cells filled, each cell times the root of its
// weight.
class WeightedRows {
 public:
  WeightedRows(const Job& job, double tail_weight)
      : job_(job), window_(static_cast<std::size_t>(job.source.header().WindowSize())) {
    const double noise = NoiseFloor(job);
    for (const ChannelScan& scan : job.scans) {
      const double largest = *std::max_element(scan.mean.begin(), scan.mean.end());
      for (const double mean : scan.mean) {
        const double r = (std::max(mean, 0.0) + noise) / std::max(largest, 1e-300) +
                         reconstruct::kLogFloor;
        root_weight_.push_back(std::pow(r, -0.5 * tail_weight));
      }
    }
  }

  void Make(const float* rd, const std::uint8_t* valid, double* row) const {
    for (std::size_t c = 0; c < job_.scans.size(); ++c) {
      const std::size_t at = c * window_;
      FillRow({rd + at, window_},
              {valid + at, window_},
              job_.scans[c],
              {row + at, window_});
    }
    const double scale = job_.Peak() > 0 ? 1 / job_.Peak() : 1;
    for (std::size_t n = 0; n < root_weight_.size(); ++n) {
      row[n] *= root_weight_[n] * scale;
    }
  }

 private:
  const Job& job_;
  std::size_t window_;
  std::vector<double> root_weight_;
};

Eigen::MatrixXd SampleBasis(const Job& job, const WeightedRows& rows, int terms) {
  const reconstruct::RdDataset& sample = job.sample.dataset;
  const std::int64_t size = sample.header.SliceSize();
  RowMatrix y(std::ssize(job.sample.rows), size);
  for (Eigen::Index row = 0; row < y.rows(); ++row) {
    const auto at = static_cast<std::size_t>(row * size);
    rows.Make(&sample.rd[at], &sample.valid[at], &y(row, 0));
  }
  return ComputeTruncatedSvd(y, terms).basis;
}

// Adds a block's measurements of one channel and offset, both ways round.
void AddBlock(const SliceBlock& block,
              const reconstruct::RdHeader& header,
              std::size_t channel,
              std::size_t cell,
              BilinearData& data) {
  const std::size_t plane = data.Offset(channel, cell);
  const auto window = static_cast<std::size_t>(header.WindowSize());
  const std::size_t mirrored = window - 1 - cell;
  const int du = data.OffsetX(cell);
  const int dv = data.OffsetY(cell);
  const float scale = static_cast<float>(1 / data.scale);
  for (std::int64_t row = 0; row < block.count; ++row) {
    const std::int64_t point = block.first + row;
    const auto x = static_cast<int>(point % header.points_x) + data.margin;
    const auto y = static_cast<int>(point / header.points_x) + data.margin;
    const auto slice =
        static_cast<std::size_t>(row * header.SliceSize()) + channel * window;
    const auto add = [&](std::size_t from, int base_x, int base_y) {
      if (block.valid[slice + from] != 0) {
        const std::size_t at =
            plane + static_cast<std::size_t>(base_y * data.width + base_x);
        data.values[at] += block.rd[slice + from] * scale;
        ++data.count[at];
      }
    };
    add(cell, x, y);
    if (mirrored != cell) {
      add(mirrored, x - du, y - dv);
    }
  }
}

// Sums become means; weights follow from the mean over a plane.
void FinishPlanes(const Job& job, double tail_weight, BilinearData& data) {
  const std::size_t plane = data.Plane();
  data.weight.assign(data.channels * data.cells, 1);
  ParallelFor(std::ssize(data.weight), job.options.thread_count, [&](std::int64_t n) {
    const auto first = static_cast<std::size_t>(n) * plane;
    double sum = 0;
    double used = 0;
    for (std::size_t at = first; at < first + plane; ++at) {
      if (data.count[at] > 0) {
        sum += static_cast<double>(data.values[at]);
        used += data.count[at];
        data.values[at] /= static_cast<float>(data.count[at]);
      }
    }
    data.weight[static_cast<std::size_t>(n)] = used > 0 ? std::max(sum / used, 0.0) : 0;
  });
  const double largest = *std::max_element(data.weight.begin(), data.weight.end());
  const double noise = NoiseFloor(job) / data.scale;
  for (double& weight : data.weight) {
    weight =
        std::pow((weight + noise) / std::max(largest, 1e-300) + reconstruct::kLogFloor,
                 -tail_weight);
  }
  for (std::size_t c = 1; c < data.channels; ++c) {
    const auto first = data.count.begin();
    const auto size = static_cast<std::ptrdiff_t>(data.Offset(1, 0));
    data.same_count =
        data.same_count &&
        std::equal(first, first + size, first + static_cast<std::ptrdiff_t>(c) * size);
  }
}

}  // namespace

double PairBytes(const reconstruct::RdHeader& header) {
  const double width = header.points_x + header.core - 1;
  const double height = header.points_y + header.core - 1;
  return 5.0 * width * height * static_cast<double>(header.SliceSize() + 1) / 2;
}

BilinearData ReadPairs(Job& job, int terms, double tail_weight, SharedMaps& start) {
  const reconstruct::RdHeader& header = job.source.header();
  BilinearData data;
  data.margin = header.Radius();
  data.width = header.points_x + 2 * data.margin;
  data.height = header.points_y + 2 * data.margin;
  data.core = header.core;
  data.channels = header.channels.size();
  data.cells = static_cast<std::size_t>(header.WindowSize() + 1) / 2;
  data.scale = job.Peak() > 0 ? job.Peak() : 1;
  data.values.assign(data.channels * data.cells * data.Plane(), 0.0F);
  data.count.assign(data.values.size(), 0);

  const WeightedRows rows(job, tail_weight);
  const Eigen::MatrixXd basis = SampleBasis(job, rows, terms);
  start = SharedMaps::Zero(std::max<Eigen::Index>(basis.cols(), 1),
                           static_cast<Eigen::Index>(data.Plane()));
  const std::int64_t points = header.PointCount();
  for (std::int64_t first = 0; first < points; first += kBlockRows) {
    Report(job.progress, {"factor", first, points, "pairs"});
    const SliceBlock block =
        job.source.Read(first, std::min(kBlockRows, points - first));
    ParallelFor(static_cast<std::int64_t>(data.channels * data.cells),
                job.options.thread_count,
                [&](std::int64_t n) {
                  const auto plane = static_cast<std::size_t>(n);
                  AddBlock(block, header, plane / data.cells, plane % data.cells, data);
                });
    ParallelFor(block.count, job.options.thread_count, [&](std::int64_t row) {
      Eigen::VectorXd y(header.SliceSize());
      const std::int64_t at = row * header.SliceSize();
      rows.Make(block.rd + at, block.valid + at, y.data());
      const std::int64_t point = first + row;
      const std::int64_t to = (point / header.points_x + data.margin) * data.width +
                              point % header.points_x + data.margin;
      if (basis.cols() > 0) {
        start.col(to) = (basis.transpose() * y).cast<float>();
      }
    });
  }
  ++job.passes;
  ExtendMaps(data.width, data.height, data.margin, start);
  FinishPlanes(job, tail_weight, data);
  return data;
}

}  // namespace nacre::factor::internal
