#include "bench/factor/svd_oracle.h"

#include <algorithm>
#include <cmath>
#include <vector>

extern "C" {
void dsyrk_(const char*,
            const char*,
            const int*,
            const int*,
            const double*,
            const double*,
            const int*,
            const double*,
            double*,
            const int*);
void dsyevr_(const char*,
             const char*,
             const char*,
             const int*,
             double*,
             const int*,
             const double*,
             const double*,
             const int*,
             const int*,
             const double*,
             int*,
             double*,
             double*,
             const int*,
             int*,
             double*,
             const int*,
             int*,
             const int*,
             int*);
void sgesdd_(const char*,
             const int*,
             const int*,
             float*,
             const int*,
             float*,
             float*,
             const int*,
             float*,
             const int*,
             float*,
             const int*,
             int*,
             int*);
}

namespace nacre::bench {
namespace {

using factor::internal::RowMatrix;
using factor::internal::RowTransform;
using reconstruct::RdDataset;

constexpr std::int64_t kRows = 2048;

// Calls body(first, rows) with blocks of transformed rows.
template <class Body>
void ForBlocks(const RdDataset& data, const RowTransform& transform, Body&& body) {
  const std::int64_t points = data.header.PointCount();
  const std::int64_t window = data.header.WindowSize();
  for (std::int64_t first = 0; first < points; first += kRows) {
    RowMatrix rows(std::min(kRows, points - first), window);
    for (std::int64_t n = 0; n < rows.size(); ++n) {
      rows.data()[n] = transform.Forward(
          static_cast<double>(data.rd[static_cast<std::size_t>(first * window + n)]));
    }
    body(first, rows);
  }
}

}  // namespace

Oracle ExactSvd(const RdDataset& data, const RowTransform& transform, int terms) {
  const auto n = static_cast<int>(data.header.WindowSize());
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(n, n);
  Oracle oracle;
  ForBlocks(data, transform, [&](std::int64_t, const RowMatrix& rows) {
    const auto count = static_cast<int>(rows.rows());
    const double one = 1;
    dsyrk_("L", "N", &n, &count, &one, rows.data(), &n, &one, gram.data(), &n);
    oracle.squares += rows.squaredNorm();
  });
  const int first = n - terms + 1;
  const double none = 0;
  int found = 0;
  int info = 0;
  Eigen::VectorXd values(n);
  Eigen::MatrixXd vectors(n, terms);
  std::vector<int> support(2 * static_cast<std::size_t>(terms));
  std::vector<double> work(64 * static_cast<std::size_t>(n));
  std::vector<int> whole(64 * static_cast<std::size_t>(n));
  const auto work_size = static_cast<int>(work.size());
  const auto whole_size = static_cast<int>(whole.size());
  dsyevr_("V",
          "I",
          "L",
          &n,
          gram.data(),
          &n,
          &none,
          &none,
          &first,
          &n,
          &none,
          &found,
          values.data(),
          vectors.data(),
          &n,
          support.data(),
          work.data(),
          &work_size,
          whole.data(),
          &whole_size,
          &info);
  oracle.vectors = vectors.rowwise().reverse();
  const double left = oracle.squares - values.head(terms).sum();
  oracle.error = info == 0 ? std::sqrt(std::max(0.0, left) / oracle.squares) : -1;
  return oracle;
}

Difference Compare(const RdDataset& data,
                   const RowTransform& transform,
                   const Oracle& exact,
                   const factor::internal::BlockSvd& svd) {
  double exact_squares = 0;
  double found_squares = 0;
  double between = 0;
  double norm = 0;
  const Eigen::Index rank = svd.sigma.size();
  ForBlocks(data, transform, [&](std::int64_t first, const RowMatrix& rows) {
    const RowMatrix best = (rows * exact.vectors) * exact.vectors.transpose();
    const Eigen::Map<
        const Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>
        scores(&svd.scores[static_cast<std::size_t>(first * rank)], rows.rows(), rank);
    const RowMatrix found = scores.cast<double>() * svd.vectors.transpose();
    exact_squares += (rows - best).squaredNorm();
    found_squares += (rows - found).squaredNorm();
    between += (found - best).squaredNorm();
    norm += best.squaredNorm();
  });
  return {std::sqrt(found_squares / exact_squares) - 1, std::sqrt(between / norm)};
}

double LapackError(const RdDataset& data, const RowTransform& transform, int terms) {
  const auto columns = static_cast<int>(data.header.WindowSize());
  const auto points = static_cast<int>(data.header.PointCount());
  std::vector<float> y(data.rd.size());
  double squares = 0;
  ForBlocks(data, transform, [&](std::int64_t first, const RowMatrix& rows) {
    std::transform(rows.data(),
                   rows.data() + rows.size(),
                   &y[static_cast<std::size_t>(first * columns)],
                   [](double value) { return static_cast<float>(value); });
    squares += rows.squaredNorm();
  });
  // Row-major Y is column-major Yᵀ: columns × points.
  std::vector<float> sigma(static_cast<std::size_t>(columns));
  std::vector<float> u(static_cast<std::size_t>(columns) *
                       static_cast<std::size_t>(columns));
  std::vector<float> vt(y.size());
  std::vector<int> whole(8 * static_cast<std::size_t>(columns));
  float size = 0;
  int query = -1;
  int info = 0;
  sgesdd_("S",
          &columns,
          &points,
          y.data(),
          &columns,
          sigma.data(),
          u.data(),
          &columns,
          vt.data(),
          &columns,
          &size,
          &query,
          whole.data(),
          &info);
  std::vector<float> work(static_cast<std::size_t>(size) + 1);
  const auto work_size = static_cast<int>(work.size());
  sgesdd_("S",
          &columns,
          &points,
          y.data(),
          &columns,
          sigma.data(),
          u.data(),
          &columns,
          vt.data(),
          &columns,
          work.data(),
          &work_size,
          whole.data(),
          &info);
  double left = squares;
  for (int j = 0; j < terms; ++j) {
    const auto s = static_cast<double>(sigma[static_cast<std::size_t>(j)]);
    left -= s * s;
  }
  return info == 0 ? std::sqrt(std::max(0.0, left) / squares) : -1;
}

}  // namespace nacre::bench
