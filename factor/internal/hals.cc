#include "factor/internal/hals.h"

#include "core/lot_sum.h"
#include "core/parallel.h"
#include "core/random.h"
#include "factor/internal/row_lots.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace nacre::factor::internal {
namespace {

constexpr double kEnough = 1e-5;
constexpr std::int64_t kSweepRows = 64;

// Rows for H to start with, each drawn with a probability that grows with its squared
// distance from those chosen so far [Arthur07]. Nothing is drawn twice.
std::vector<Eigen::Index> SpreadRows(const RowMatrix& y,
                                     int count,
                                     std::uint64_t seed) {
  RandomStream random(seed, 0x6E6D66);
  std::vector<Eigen::Index> chosen;
  Eigen::Index first = 0;
  y.rowwise().squaredNorm().maxCoeff(&first);
  chosen.push_back(first);
  Eigen::VectorXd distance = (y.rowwise() - y.row(first)).rowwise().squaredNorm();
  while (static_cast<int>(chosen.size()) < count && distance.sum() > 0) {
    double left = random.Uniform() * distance.sum();
    Eigen::Index next = 0;
    while (next + 1 < distance.size() && left >= distance(next)) {
      left -= distance(next++);
    }
    if (!(distance(next) > 0)) {
      distance.maxCoeff(&next);
    }
    chosen.push_back(next);
    distance = distance.cwiseMin((y.rowwise() - y.row(next)).rowwise().squaredNorm());
  }
  return chosen;
}

// What is summed over the rows of F: the error but for the squares of Y, FᵀF and YᵀF.
struct RowSums {
  double error = 0;
  Eigen::MatrixXd gram;
  Eigen::MatrixXd cross;
};

std::vector<double> Packed(const RowSums& sums) {
  std::vector<double> values{sums.error};
  values.insert(values.end(), sums.gram.data(), sums.gram.data() + sums.gram.size());
  values.insert(values.end(), sums.cross.data(), sums.cross.data() + sums.cross.size());
  return values;
}

RowSums Unpacked(const std::vector<double>& values,
                 Eigen::Index terms,
                 Eigen::Index columns) {
  const double* gram = values.data() + 1;
  return {values[0],
          Eigen::Map<const Eigen::MatrixXd>(gram, terms, terms),
          Eigen::Map<const Eigen::MatrixXd>(gram + terms * terms, columns, terms)};
}

// Two sweeps over rows [first, first + count) of F, and what they sum to.
RowSums SweepRows(const RowMatrix& y,
                  Eigen::Index first,
                  Eigen::Index count,
                  const Eigen::MatrixXd& gram,
                  Nonnegative& model) {
  const auto rows = y.middleRows(first, count);
  const Eigen::MatrixXd cross = rows * model.h.transpose();
  Eigen::MatrixXd f = model.f.middleRows(first, count);
  // Products with Y cost most: what they give is used twice.
  HalsSweep(gram, cross, f);
  HalsSweep(gram, cross, f);
  RowSums sums{0, f.transpose() * f, rows.transpose() * f};
  sums.error = sums.gram.cwiseProduct(gram).sum() - 2 * f.cwiseProduct(cross).sum();
  model.f.middleRows(first, count) = f;
  return sums;
}

// A round's sweeps over all rows of F.
RowSums SweepAll(const RowMatrix& y,
                 const RowLots& lots,
                 const Workers& workers,
                 Nonnegative& model) {
  const Eigen::MatrixXd gram = model.h * model.h.transpose();
  const RankShare own = ShareOf(lots.count(), workers.ranks);
  std::vector<std::vector<double>> of_lot(
      static_cast<std::size_t>(own.end - own.begin));
  ParallelFor(std::ssize(of_lot), workers.thread_count, [&](std::int64_t n) {
    const Eigen::Index first = lots.Begin(own.begin + n);
    const Eigen::Index count = lots.Begin(own.begin + n + 1) - first;
    of_lot[static_cast<std::size_t>(n)] =
        Packed(SweepRows(y, first, count, gram, model));
  });
  LotSum sum(lots.count(), workers.ranks);
  for (std::vector<double>& values : of_lot) {
    sum.Add(std::move(values));
  }
  return Unpacked(sum.Finish(), model.h.rows(), y.cols());
}

}  // namespace

void HalsSweep(const Eigen::MatrixXd& gram,
               const Eigen::MatrixXd& cross,
               Eigen::MatrixXd& f) {
  for (Eigen::Index j = 0; j < f.cols(); ++j) {
    if (gram(j, j) > 0) {
      f.col(j) = (f.col(j) + (cross.col(j) - f * gram.col(j)) / gram(j, j)).cwiseMax(0);
    } else {
      f.col(j).setZero();  // of no use to anything
    }
  }
}

Nonnegative FactorNonnegative(const RowMatrix& y,
                              const RowMatrix& start,
                              const NonnegativeOptions& options) {
  const Eigen::Index given = std::min<Eigen::Index>(options.terms, start.rows());
  const auto more = options.terms - static_cast<int>(given);
  const std::vector<Eigen::Index> rows =
      more > 0 ? SpreadRows(y, more, options.seed) : std::vector<Eigen::Index>{};
  Nonnegative model;
  model.h.resize(given + std::ssize(rows), y.cols());
  if (given > 0) {  // an empty start has no columns
    model.h.topRows(given) = start.topRows(given).cwiseMax(0);
  }
  for (std::size_t j = 0; j < rows.size(); ++j) {
    model.h.row(given + static_cast<Eigen::Index>(j)) = y.row(rows[j]).cwiseMax(0);
  }
  model.f = Eigen::MatrixXd::Constant(y.rows(), model.h.rows(), 1.0);
  const RowLots lots(y.rows(), kSweepRows);
  const double squares = y.squaredNorm();
  double before = 0;
  for (int round = 0; round < options.rounds; ++round) {
    model.rounds = round + 1;
    const RowSums sums = SweepAll(y, lots, options.workers, model);
    const double error = squares + sums.error;
    if (round > 0 && before - error <= kEnough * std::max(error, 0.0)) {
      break;
    }
    before = error;
    Eigen::MatrixXd h = model.h.transpose();
    HalsSweep(sums.gram, sums.cross, h);
    HalsSweep(sums.gram, sums.cross, h);
    model.h = h.transpose();
  }
  for (Eigen::Index j = 0; j < model.f.cols(); ++j) {
    lots.Join(options.workers.ranks,
              std::span(model.f.col(j).data(), static_cast<std::size_t>(y.rows())));
  }
  return model;
}

}  // namespace nacre::factor::internal
