#include "factor/internal/hals.h"

#include "core/random.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace nacre::factor::internal {
namespace {

constexpr double kEnough = 1e-5;

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

double Error(const Nonnegative& model,
             double squares,
             const Eigen::MatrixXd& gram,
             const Eigen::MatrixXd& cross) {
  return squares - 2 * model.f.cwiseProduct(cross).sum() +
         (model.f.transpose() * model.f).cwiseProduct(gram).sum();
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
                              int terms,
                              int rounds,
                              std::uint64_t seed) {
  const Eigen::Index given = std::min<Eigen::Index>(terms, start.rows());
  const auto more = terms - static_cast<int>(given);
  const std::vector<Eigen::Index> rows =
      more > 0 ? SpreadRows(y, more, seed) : std::vector<Eigen::Index>{};
  Nonnegative model;
  model.h.resize(given + std::ssize(rows), y.cols());
  if (given > 0) {  // an empty start has no columns
    model.h.topRows(given) = start.topRows(given).cwiseMax(0);
  }
  for (std::size_t j = 0; j < rows.size(); ++j) {
    model.h.row(given + static_cast<Eigen::Index>(j)) = y.row(rows[j]).cwiseMax(0);
  }
  model.f = Eigen::MatrixXd::Constant(y.rows(), model.h.rows(), 1.0);
  const double squares = y.squaredNorm();
  double before = 0;
  for (int round = 0; round < rounds; ++round) {
    model.rounds = round + 1;
    const Eigen::MatrixXd gram = model.h * model.h.transpose();
    const Eigen::MatrixXd cross = y * model.h.transpose();
    // Products with Y cost most: what they give is used twice.
    HalsSweep(gram, cross, model.f);
    HalsSweep(gram, cross, model.f);
    const double error = Error(model, squares, gram, cross);
    if (round > 0 && before - error <= kEnough * std::max(error, 0.0)) {
      break;
    }
    before = error;
    const Eigen::MatrixXd f_gram = model.f.transpose() * model.f;
    const Eigen::MatrixXd f_cross = y.transpose() * model.f;
    Eigen::MatrixXd h = model.h.transpose();
    HalsSweep(f_gram, f_cross, h);
    HalsSweep(f_gram, f_cross, h);
    model.h = h.transpose();
  }
  return model;
}

}  // namespace nacre::factor::internal
