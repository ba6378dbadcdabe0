#include "factor/internal/block_pass.h"

#include "core/parallel.h"
#include "factor/internal/row_kernels.h"

#include <algorithm>

namespace nacre::factor::internal {
namespace {

constexpr std::int64_t kRows = 128;  // whose sums are floats; they fit the cache
constexpr std::int64_t kLanes = 8;   // sums kept apart, so that as many threads can add

using FloatRows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// The sums of every eighth block of rows.
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
    for (Lane& lane : lanes_) {
      lane.z.assign(v_.size(), 0.0);
      lane.gram = Eigen::MatrixXd::Zero(basis.cols(), basis.cols());
      lane.sum = Eigen::VectorXd::Zero(basis.cols());
    }
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

  BlockProduct Finish() {
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
    product_.z.resize(columns_, total.sum.size());
    for (Eigen::Index k = 0; k < product_.z.cols(); ++k) {
      for (Eigen::Index column = 0; column < columns_; ++column) {
        product_.z(column, k) = total.z[PanelIndex(k / kPanel, width_, column) +
                                        static_cast<std::size_t>(k % kPanel)];
      }
    }
    product_.gram = std::move(total.gram);
    product_.sum = std::move(total.sum);
    product_.squares = total.squares;
    return std::move(product_);
  }

 private:
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

std::vector<BlockProduct> RunBlockPass(SliceSource& source,
                                       const FillRowFunction& fill,
                                       const std::vector<std::size_t>& channels,
                                       const std::vector<Eigen::MatrixXd>& bases,
                                       int thread_count,
                                       const ProgressFunction& progress,
                                       const std::string& note) {
  const std::int64_t points = source.header().PointCount();
  std::vector<ChannelPass> passes;
  for (const Eigen::MatrixXd& basis : bases) {
    passes.emplace_back(basis, points);
  }
  const auto matrices = static_cast<std::int64_t>(channels.size());
  for (std::int64_t first = 0; first < points; first += kRows * kLanes) {
    Report(progress, {"factor", first, points, note});
    const SliceBlock block =
        source.Read(first, std::min(kRows * kLanes, points - first));
    const std::int64_t parts = (block.count + kRows - 1) / kRows;
    ParallelFor(matrices * parts, thread_count, [&](std::int64_t task) {
      const auto matrix = static_cast<std::size_t>(task / parts);
      const std::int64_t start = task % parts * kRows;
      passes[matrix].Add(first + start,
                         std::min(kRows, block.count - start),
                         [&](std::int64_t row, float* y) {
                           return fill(block, start + row, channels[matrix], y);
                         });
    });
  }
  std::vector<BlockProduct> products;
  for (ChannelPass& pass : passes) {
    products.push_back(pass.Finish());
  }
  return products;
}

}  // namespace nacre::factor::internal
