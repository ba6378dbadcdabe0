// Chooses the widths of the Gaussians of which profiles are sums.

#include "factor/internal/profile_equations.h"
#include "reconstruct/error_figures.h"

#include <algorithm>
#include <cmath>

namespace nacre::factor::internal {
namespace {

std::vector<double> Weights(const ChannelScan& scan, double tail_weight) {
  const double largest = *std::max_element(scan.mean.begin(), scan.mean.end());
  const double scale = largest > 0 ? largest : 1;
  const double least = std::max(-scan.least / scale, reconstruct::kLogFloor);
  std::vector<double> weights;
  for (const double mean : scan.mean) {
    weights.push_back(std::pow(std::max(mean / scale, 0.0) + least, -tail_weight) /
                      (scale * scale));
  }
  return weights;
}

// Widths between the two ends, the narrowest first.
std::vector<double> Series(double log_narrow, double log_wide, int terms) {
  std::vector<double> beta;
  for (int t = 0; t < terms; ++t) {
    const double part = terms > 1 ? static_cast<double>(t) / (terms - 1) : 0.5;
    const double log_sigma = log_narrow + part * (log_wide - log_narrow);
    beta.push_back(std::exp(-2 * log_sigma));
  }
  return beta;
}

class MeanSliceFit {
 public:
  MeanSliceFit(const reconstruct::RdHeader& header,
               const ChannelScan& scan,
               const std::vector<double>& weights)
      : header_(header), scan_(scan), weights_(weights) {}

  // Of the weighted squares, what a nonnegative sum of these Gaussians leaves.
  double Error(const std::vector<double>& beta) const {
    const auto terms = static_cast<Eigen::Index>(beta.size());
    std::vector<Gaussian> gaussians;
    gaussians.reserve(beta.size());
    for (const double b : beta) {
      gaussians.emplace_back(b, header_.Radius(), header_.pitch_mm);
    }
    ProfileEquations equations(terms);
    double squares = 0;
    GaussianValues a(terms);
    for (std::size_t cell = 0; cell < weights_.size(); ++cell) {
      const auto n = static_cast<int>(cell);
      for (Eigen::Index t = 0; t < terms; ++t) {
        a(t) = gaussians[static_cast<std::size_t>(t)].At(
            n % header_.core - header_.Radius(), n / header_.core - header_.Radius());
      }
      equations.Add(a, scan_.mean[cell], weights_[cell]);
      squares += weights_[cell] * scan_.mean[cell] * scan_.mean[cell];
    }
    const Eigen::VectorXd x = equations.Solve();
    return squares - 2 * x.dot(equations.Cross()) + x.dot(equations.Gram() * x);
  }

 private:
  const reconstruct::RdHeader& header_;
  const ChannelScan& scan_;
  const std::vector<double>& weights_;
};

}  // namespace

ProfileBasis ChooseGaussians(const reconstruct::RdHeader& header,
                             const ChannelScan& scan,
                             int terms,
                             double tail_weight) {
  ProfileBasis basis;
  basis.weight = Weights(scan, tail_weight);
  const MeanSliceFit fit(header, scan, basis.weight);
  const double low = std::log(0.2 * header.pitch_mm);
  const double high = std::log((2 * header.Radius() + 1) * header.pitch_mm);
  double narrow = low;
  double wide = high;
  double least = fit.Error(Series(narrow, wide, terms));
  const auto attempt = [&](double a, double b) {
    if (a > b || a < low || b > high) {
      return;
    }
    const double error = fit.Error(Series(a, b, terms));
    if (error < least) {
      least = error;
      narrow = a;
      wide = b;
    }
  };
  constexpr int kCoarse = 6;
  for (int i = 0; i <= kCoarse; ++i) {
    for (int j = i; j <= kCoarse; ++j) {
      attempt(low + i * (high - low) / kCoarse, low + j * (high - low) / kCoarse);
    }
  }
  // Pattern search: a step either way along each end, halved.
  for (double step = (high - low) / (2 * kCoarse); step > 0.01; step /= 2) {
    const double a = narrow;
    const double b = wide;
    for (const double sign : {-1.0, 1.0}) {
      attempt(a + sign * step, b);
      attempt(a, b + sign * step);
      attempt(a + sign * step, b + sign * step);
    }
  }
  basis.beta_per_mm2 = Series(narrow, wide, terms);
  for (const double beta : basis.beta_per_mm2) {
    basis.gaussians.emplace_back(beta, header.Radius(), header.pitch_mm);
  }
  return basis;
}

}  // namespace nacre::factor::internal
