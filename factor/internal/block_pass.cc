#include "factor/internal/block_pass.h"

#include "core/lot_sum.h"
#include "core/parallel.h"
#include "factor/internal/row_kernels.h"

#include <algorithm>

namespace nacre::factor::internal {
namespace {

constexpr std::int64_t kRows = 128;  // whose sums are floats; they fit the cache
constexpr std::int64_t kLanes = 8;   // sums kept apart, so that as many threads can add
constexpr std::int64_t kChunk = kRows * kLanes;  // read at a time

using FloatRows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// The sums of every eighth block of a lot's rows.
struct Lane {
  std::vector<double> z;  // [panel][column][kPanel]
  Eigen::MatrixXd gram;
  Eigen::VectorXd sum;
  double squares = 0;
};

// One channel's share of a pass.
class ChannelPass {
 public:
  ChannelPass(const Eigen::MatrixXd& basis, std::int64_t row_count)
      : columns_(basis.rows()),
        width_(PaddedColumns(basis.rows())),
        panels_(basis.cols() / kPanel),
        row_count_(row_count),
        v_(static_cast<std::size_t>(width_ * basis.cols()), 0.0F),
        lanes_(kLanes) {
    for (Eigen::Index k = 0; k < basis.cols(); ++k) {
      for (Eigen::Index column = 0; column < basis.rows(); ++column) {
        v_[PanelIndex(k / kPanel, width_, column) +
           static_cast<std::size_t>(k % kPanel)] = static_cast<float>(basis(column, k));
      }
    }
    product_.u.resize(static_cast<std::size_t>(row_count * basis.cols()));
    Clear();
  }

  // Rows [first, first + count) of the pass, `count` ≤ kRows.
  template <class Fill>
  void Add(std::int64_t first, std::int64_t count, const Fill& fill) {
    Lane& lane = lanes_[static_cast<std::size_t>(first / kRows % kLanes)];
    thread_local std::vector<float> rows;
    rows.resize(static_cast<std::size_t>(count * width_));
    for (std::int64_t row = 0; row < count; ++row) {
      lane.squares += static_cast<double>(fill(row, rows.data() + row * width_));
    }
    const RowBlock y{rows.data(), count, width_};
    Eigen::MatrixXd u(count, panels_ * kPanel);
    for (std::int64_t panel = 0; panel < panels_; ++panel) {
      float* to = &product_.u[PanelIndex(panel, row_count_, first)];
      MultiplyPanel(y, &v_[PanelIndex(panel, width_, 0)], to);
      AddTransposedPanel(y, to, &lane.z[PanelIndex(panel, width_, 0)]);
      u.middleCols(panel * kPanel, kPanel) =
          Eigen::Map<const FloatRows>(to, count, kPanel).cast<double>();
    }
    lane.gram.noalias() += u.transpose() * u;
    lane.sum += u.colwise().sum().transpose();
  }

  // Appends what was added since the last call to `sums`.
  void TakeLot(std::vector<double>& sums) {
    Lane& total = lanes_.front();
    for (std::size_t n = 1; n < lanes_.size(); ++n) {
      std::transform(total.z.begin(),
                     total.z.end(),
                     lanes_[n].z.begin(),
                     total.z.begin(),
                     std::plus<>());
      total.gram += lanes_[n].gram;
      total.sum += lanes_[n].sum;
      total.squares += lanes_[n].squares;
    }
    sums.insert(sums.end(), total.z.begin(), total.z.end());
    sums.insert(sums.end(), total.gram.data(), total.gram.data() + total.gram.size());
    sums.insert(sums.end(), total.sum.begin(), total.sum.end());
    sums.push_back(total.squares);
    Clear();
  }

  // `sums`: of all lots, from which it takes its own off the front.
  BlockProduct Finish(std::span<const double>& sums) {
    const Eigen::Index size = panels_ * kPanel;
    const auto take = [&](Eigen::Index count) {
      const std::span<const double> front = sums.first(static_cast<std::size_t>(count));
      sums = sums.subspan(front.size());
      return front;
    };
    const std::span<const double> z = take(std::ssize(v_));
    product_.z.resize(columns_, size);
    for (Eigen::Index k = 0; k < size; ++k) {
      for (Eigen::Index column = 0; column < columns_; ++column) {
        product_.z(column, k) = z[PanelIndex(k / kPanel, width_, column) +
                                  static_cast<std::size_t>(k % kPanel)];
      }
    }
    product_.gram =
        Eigen::Map<const Eigen::MatrixXd>(take(size * size).data(), size, size);
    product_.sum = Eigen::Map<const Eigen::VectorXd>(take(size).data(), size);
    product_.squares = take(1).front();
    return std::move(product_);
  }

 private:
  void Clear() {
    const Eigen::Index size = panels_ * kPanel;
    for (Lane& lane : lanes_) {
      lane.z.assign(v_.size(), 0.0);
      lane.gram = Eigen::MatrixXd::Zero(size, size);
      lane.sum = Eigen::VectorXd::Zero(size);
      lane.squares = 0;
    }
  }

  static std::size_t PanelIndex(std::int64_t panel,
                                std::int64_t height,
                                std::int64_t row) {
    return static_cast<std::size_t>((panel * height + row) * kPanel);
  }

  std::int64_t columns_;
  std::int64_t width_;
  std::int64_t panels_;
  std::int64_t row_count_;
  std::vector<float> v_;
  std::vector<Lane> lanes_;
  BlockProduct product_;
};

}  // namespace

RowLots PassLots(std::int64_t points) {
  return RowLots(points, kChunk);
}

std::vector<BlockProduct> RunBlockPass(SliceSource& source,
                                       const PassMatrices& y,
                                       const Workers& workers,
                                       const ProgressFunction& progress,
                                       const std::string& note) {
  const std::int64_t points = source.header().PointCount();
  std::vector<ChannelPass> passes;
  passes.reserve(y.bases.size());
  for (const Eigen::MatrixXd& basis : y.bases) {
    passes.emplace_back(basis, points);
  }
  const auto matrices = static_cast<std::int64_t>(y.channels.size());
  const auto add_chunk = [&](std::int64_t first, std::int64_t end) {
    const SliceBlock block = source.Read(first, std::min(kChunk, end - first));
    const std::int64_t parts = (block.count + kRows - 1) / kRows;
    ParallelFor(matrices * parts, workers.thread_count, [&](std::int64_t task) {
      const auto matrix = static_cast<std::size_t>(task / parts);
      const std::int64_t start = task % parts * kRows;
      passes[matrix].Add(first + start,
                         std::min(kRows, block.count - start),
                         [&](std::int64_t row, float* to) {
                           return y.fill(block, start + row, y.channels[matrix], to);
                         });
    });
  };
  const RowLots lots = PassLots(points);
  LotSum sum(lots.count(), workers.ranks);
  const RankShare own = ShareOf(lots.count(), workers.ranks);
  for (std::int64_t lot = own.begin; lot < own.end; ++lot) {
    const std::int64_t end = lots.Begin(lot + 1);
    for (std::int64_t first = lots.Begin(lot); first < end; first += kChunk) {
      Report(progress, {"factor", first, points, note});
      add_chunk(first, end);
    }
    std::vector<double> sums;
    for (ChannelPass& pass : passes) {
      pass.TakeLot(sums);
    }
    sum.Add(std::move(sums));
  }
  const std::vector<double> total = sum.Finish();
  std::span<const double> left = total;
  std::vector<BlockProduct> products;
  products.reserve(passes.size());
  for (ChannelPass& pass : passes) {
    products.push_back(pass.Finish(left));
  }
  return products;
}

}  // namespace nacre::factor::internal
