#include "factor/internal/transform_search.h"

#include "factor/internal/fit_error.h"
#include "reconstruct/error_figures.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

namespace nacre::factor::internal {
namespace {

constexpr double kLogLimit = 4.605170185988091;  // ln 100: c up to 100 peaks
constexpr double kSlack = 0.05;
constexpr int kFewRows = 64;
constexpr int kRowsATerm = 8;
constexpr double kSmallestOffset = 1e-4;  // of the peak: below, noise is amplified

// One dimension of the search, keeping the best point seen.
class Minimum {
 public:
  explicit Minimum(std::function<double(double, double)> objective)
      : objective_(std::move(objective)) {}

  double Try(double log_c, double log_b) {
    const double value = objective_(log_c, log_b);
    ++evaluations_;
    if (evaluations_ == 1 || value < best_) {
      best_ = value;
      log_c_ = log_c;
      log_b_ = log_b;
    }
    return value;
  }

  // Golden section [Kiefer53] of f over [low, high].
  void Narrow(double low,
              double high,
              int steps,
              const std::function<double(double)>& f) {
    constexpr double kGolden = 1 / std::numbers::phi;
    double left = high - kGolden * (high - low);
    double right = low + kGolden * (high - low);
    double at_left = f(left);
    double at_right = f(right);
    for (int step = 2; step < steps; ++step) {
      if (at_left <= at_right) {
        high = right;
        right = left;
        at_right = at_left;
        left = high - kGolden * (high - low);
        at_left = f(left);
      } else {
        low = left;
        left = right;
        at_left = at_right;
        right = low + kGolden * (high - low);
        at_right = f(right);
      }
    }
  }

  double best() const { return best_; }
  double log_c() const { return log_c_; }
  double log_b() const { return log_b_; }
  int evaluations() const { return evaluations_; }

 private:
  std::function<double(double, double)> objective_;
  double best_ = 0;
  double log_c_ = 0;
  double log_b_ = 0;
  int evaluations_ = 0;
};

RowTransform TransformOf(double log_c, double log_b, double peak) {
  const double b = std::exp(log_b);
  return {true, peak * std::exp(log_c) / b, b};
}

// The error is flat towards large c, where the logarithm becomes linear, while that of
// the tails falls with c: of all c as good as the best to 5 %, the smallest. Bisection.
double SmallestWithinSlack(Minimum& minimum, double lowest) {
  const double enough = (1 + kSlack) * minimum.best();
  const double log_b = minimum.log_b();
  double good = minimum.log_c();
  double bad = lowest;
  for (int step = 0; step < 6; ++step) {
    const double middle = 0.5 * (good + bad);
    (minimum.Try(middle, log_b) <= enough ? good : bad) = middle;
  }
  return good;
}

}  // namespace

double TransformObjective(const RowMatrix& rd,
                          const RowTransform& transform,
                          const TransformSearch& search) {
  const RowMatrix y = rd.unaryExpr([&](double r) { return transform.Forward(r); });
  const TruncatedSvd svd = ComputeTruncatedSvd(y, search.terms, 1e-8);
  RowMatrix model = svd.scores * svd.basis.transpose();
  // exp of an extrapolated logarithm overflows; nothing real lies above 3 peaks.
  const double ceiling = transform.Forward(3 * search.peak);
  // Logarithms take half the time.
  const double floor = search.log_weight > 0 ? reconstruct::kLogFloor * search.peak
                                             : std::numeric_limits<double>::infinity();
  FitError error;
  for (Eigen::Index row = 0; row < model.rows(); ++row) {
    auto values = model.row(row);
    values = values.unaryExpr([&](double s) {
      return std::max(0.0, transform.Inverse(std::min(s, ceiling)));
    });
    const double total = values.sum();
    const double wanted = std::max(0.0, rd.row(row).sum());
    if (total > 0) {
      values *= wanted / total;
    }
    for (Eigen::Index cell = 0; cell < model.cols(); ++cell) {
      error.Add(rd(row, cell), values(cell), floor);
    }
  }
  return error.RelativeL2() +
         (search.log_weight > 0 ? search.log_weight * error.LogRms() : 0);
}

namespace {

// Every n-th row, about `wanted` of them.
RowMatrix Thin(const RowMatrix& rd, Eigen::Index wanted) {
  const Eigen::Index step = std::max<Eigen::Index>(1, rd.rows() / wanted);
  RowMatrix few((rd.rows() + step - 1) / step, rd.cols());
  for (Eigen::Index row = 0; row < few.rows(); ++row) {
    few.row(row) = rd.row(row * step);
  }
  return few;
}

}  // namespace

// The valley is found on a few rows, as the cost grows with their square; how far its
// floor reaches, on all.
TransformChoice ChooseTransform(const RowMatrix& rd, const TransformSearch& search) {
  const RowMatrix few = Thin(rd, std::max(kFewRows, kRowsATerm * search.terms));
  Minimum minimum([&](double log_c, double log_b) {
    return TransformObjective(few, TransformOf(log_c, log_b, search.peak), search);
  });
  const double lowest =
      std::min(kLogLimit,
               std::log(std::max(kSmallestOffset,
                                 2 * std::max(0.0, -search.least) / search.peak)));
  constexpr int kSteps = 6;
  const double step = (kLogLimit - lowest) / kSteps;
  for (int n = 0; n <= kSteps; ++n) {
    minimum.Try(lowest + n * step, 0);
  }
  // Along c, along B, and once more if B mattered.
  for (int round = 0; round < 2; ++round) {
    const double reach = step / (1 + round);
    const double log_b = minimum.log_b();
    minimum.Narrow(std::max(lowest, minimum.log_c() - reach),
                   std::min(kLogLimit, minimum.log_c() + reach),
                   7,
                   [&](double log_c) { return minimum.Try(log_c, log_b); });
    const double before = minimum.best();
    const double log_c = minimum.log_c();
    minimum.Narrow(log_b - 2, log_b + 2, 7, [&](double value) {
      return minimum.Try(log_c, value);
    });
    if (minimum.best() > (1 - kSlack) * before) {
      break;
    }
  }
  Minimum floor([&](double log_c, double log_b) {
    return TransformObjective(rd, TransformOf(log_c, log_b, search.peak), search);
  });
  floor.Try(minimum.log_c(), minimum.log_b());
  const double log_c = SmallestWithinSlack(floor, lowest);
  return {TransformOf(log_c, minimum.log_b(), search.peak),
          floor.best(),
          minimum.evaluations() + floor.evaluations()};
}

}  // namespace nacre::factor::internal
