#include "reconstruct/internal/gloss_fit.h"

#include "core/fresnel.h"
#include "reconstruct/internal/nonnegative_fit.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace nacre::reconstruct::internal {
namespace {

constexpr std::size_t kRings = SpotRings::kCount;
constexpr std::size_t kSpotRings = 9;  // the spot itself ends there
constexpr int kDepths = 8;
constexpr double kDeeper = 1.45;  // each depth than the one before
constexpr std::array<double, 5> kAttenuations = {0.05, 0.3, 0.6, 0.9, 1.2};
constexpr Eigen::Index kDipoles = kDepths * static_cast<Eigen::Index>(5);
constexpr std::size_t kClasses = 8;
constexpr std::size_t kFewSpots = 6;  // a class has no fewer

// Exitance over a point source at depth z [Jensen01, eq. 4], r² + z² = d²; without
// factors that are common to all.
double FromSource(double z, double sigma_tr, double r2) {
  const double d2 = r2 + z * z;
  const double d = std::sqrt(d2);
  return z * (1 + sigma_tr * d) * std::exp(-sigma_tr * d) / (d2 * d);
}

// The spot on the reference as a density over the plane, by rings.
class Blur {
 public:
  explicit Blur(const SpotRings& reference) {
    constexpr int kAround = 10;
    for (std::size_t k = 0; k < kSpotRings; ++k) {
      const double r = reference.RadiusMm(k);
      const double light = static_cast<double>(reference.sum[k]);
      sum_ += light;
      square_mm2_ += light * r * r;
      for (int a = 0; a < kAround; ++a) {
        const double angle = std::numbers::pi * (a + 0.5) / kAround;
        nodes_.push_back(
            {r * std::cos(angle), std::pow(r * std::sin(angle), 2), light / kAround});
      }
    }
  }

  double SigmaMm() const { return std::sqrt(0.5 * square_mm2_ / sum_); }

  template <class Profile>
  double Of(double r_mm, Profile&& profile) const {
    double sum = 0;
    for (const Node& node : nodes_) {
      sum += node.light * profile(std::pow(r_mm + node.x, 2) + node.y2);
    }
    return sum / sum_;
  }

 private:
  struct Node {
    double x, y2, light;
  };
  std::vector<Node> nodes_;
  double sum_ = 0;
  double square_mm2_ = 0;
};

// Columns of the fit: ±gloss, so that noise may take it below 0, the dipoles and a
// background.
Eigen::MatrixXd Columns(const SpotRings& reference,
                        const SpotRings& all,
                        double eta,
                        double least_depth) {
  const double inside = DiffuseFresnelReflectance(1 / eta);
  const double virtual_depths = 1 + 4.0 / 3 * (1 + inside) / (1 - inside);
  const Blur blur(reference);
  Eigen::MatrixXd columns =
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(kRings), 3 + kDipoles);
  for (std::size_t k = 0; k < kRings; ++k) {
    if (!(reference.pixels[k] > 0 && all.pixels[k] > 0)) {
      continue;
    }
    const auto row = static_cast<Eigen::Index>(k);
    const double gloss = static_cast<double>(reference.Mean(k));
    const double r_mm = all.RadiusMm(k);
    columns(row, 0) = gloss;
    columns(row, 1) = -gloss;
    columns(row, 2) = 1;
    Eigen::Index column = 3;
    double z = least_depth * blur.SigmaMm();
    for (int m = 0; m < kDepths; ++m, z *= kDeeper) {
      for (const double q : kAttenuations) {
        columns(row, column++) = blur.Of(r_mm, [&](double r2) {
          return FromSource(z, q / z, r2) + FromSource(z * virtual_depths, q / z, r2);
        });
      }
    }
  }
  return columns;
}

// Rings' relative errors are alike, but for how many pixels they have.
Estimate FitClass(const SpotRings& rings, const Eigen::MatrixXd& columns) {
  Eigen::MatrixXd weighted = Eigen::MatrixXd::Zero(columns.rows(), columns.cols());
  Eigen::VectorXd right = Eigen::VectorXd::Zero(columns.rows());
  Eigen::Index used = 0;
  for (std::size_t k = 0; k < kRings; ++k) {
    const auto row = static_cast<Eigen::Index>(k);
    if (rings.sum[k] > 0 && columns(row, 2) > 0) {
      const auto pixels = static_cast<double>(rings.pixels[k]);
      const auto mean = static_cast<double>(rings.Mean(k));
      weighted.row(row) = columns.row(row) * (std::sqrt(pixels) / mean);
      right(row) = std::sqrt(pixels);
      ++used;
    }
  }
  const Eigen::VectorXd x = FitNonnegative(weighted, right);
  // Its uncertainty, the columns in use being the right ones. Gloss is always one.
  std::vector<Eigen::Index> in_use = {0};
  for (Eigen::Index k = 2; k < x.size(); ++k) {
    if (x(k) > 0) {
      in_use.push_back(k);
    }
  }
  const auto count = static_cast<Eigen::Index>(in_use.size());
  const Eigen::MatrixXd some = weighted(Eigen::all, in_use);
  Eigen::MatrixXd normal = some.transpose() * some;
  const Eigen::VectorXd unit = Eigen::VectorXd::Unit(count, 0);
  const double inverse = normal.ldlt().solve(unit)(0);
  const double residual2 = (weighted * x - right).squaredNorm() /
                           static_cast<double>(std::max<Eigen::Index>(1, used - count));
  return {x(0) - x(1), std::sqrt(std::max(0.0, inverse) * residual2)};
}

// Whether it says anything: pictures without light, for one, don't.
bool IsUsable(const Estimate& e) {
  return std::isfinite(e.value) && e.sigma > 0 && std::isfinite(e.sigma) &&
         std::isfinite(1 / (e.sigma * e.sigma));
}

double BrightnessAside(const SpotRings& rings) {
  double sum = 0;
  double pixels = 0;
  for (std::size_t k = kSpotRings; k < kRings; ++k) {
    sum += static_cast<double>(rings.sum[k]);
    pixels += static_cast<double>(rings.pixels[k]);
  }
  return pixels > 0 ? sum / pixels : 0;
}

std::vector<SpotRings> ClassesOf(const std::vector<SpotRings>& spots) {
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t k = 0; k < spots.size(); ++k) {
    order.emplace_back(BrightnessAside(spots[k]), k);
  }
  std::sort(order.begin(), order.end());
  const std::size_t count =
      std::clamp<std::size_t>(spots.size() / kFewSpots, 1, kClasses);
  std::vector<SpotRings> classes(count);
  for (std::size_t k = 0; k < order.size(); ++k) {
    classes[k * count / order.size()].Add(spots[order[k].second]);
  }
  return classes;
}

Estimate FitChannel(const SpotsOfChannel& channel, double eta, double least_depth) {
  SpotRings all;
  for (const SpotRings& spot : channel.spots) {
    all.Add(spot);
  }
  const auto fit = [&](double least, const std::vector<SpotRings>& classes) {
    const Eigen::MatrixXd columns = Columns(channel.reference, all, eta, least);
    std::vector<Estimate> estimates;
    for (const SpotRings& one : classes) {
      const Estimate estimate = FitClass(one, columns);
      if (IsUsable(estimate)) {
        estimates.push_back(estimate);
      }
    }
    return estimates.empty() ? Estimate{} : Pool(estimates).mean;
  };
  const std::vector<SpotRings> classes = ClassesOf(channel.spots);
  Estimate best = fit(least_depth, classes);
  // Of depths that could as well have been taken.
  constexpr double kOther = 0.75;
  const double other = fit(kOther * least_depth, classes).value - best.value;
  best.sigma = std::hypot(best.sigma, 0.5 * other);
  return best;
}

}  // namespace

Pooled Pool(const std::vector<Estimate>& estimates, double tau2_least) {
  double weights = 0;
  double squares = 0;
  double mean = 0;
  for (const Estimate& e : estimates) {
    const double w = 1 / (e.sigma * e.sigma);
    weights += w;
    squares += w * w;
    mean += w * e.value;
  }
  mean /= weights;
  double q = 0;
  for (const Estimate& e : estimates) {
    q += std::pow((e.value - mean) / e.sigma, 2);
  }
  const double freedom = static_cast<double>(estimates.size()) - 1;
  const double spare = weights - squares / weights;
  Pooled pooled{
      .tau2 = std::max(tau2_least, spare > 0 ? (q - freedom) / spare : tau2_least)};
  double sum = 0;
  for (const Estimate& e : estimates) {
    const double w = 1 / (e.sigma * e.sigma + pooled.tau2);
    sum += w;
    pooled.mean.value += w * e.value;
  }
  pooled.mean.value /= sum;
  pooled.mean.sigma = 1 / std::sqrt(sum);
  return pooled;
}

std::vector<Estimate> FitGloss(const std::vector<SpotsOfChannel>& channels,
                               double eta,
                               double least_depth) {
  std::vector<Estimate> estimates;
  for (const SpotsOfChannel& channel : channels) {
    if (channel.spots.empty() || channel.reference.empty()) {
      return {};
    }
    estimates.push_back(FitChannel(channel, eta, least_depth));
    if (!IsUsable(estimates.back())) {
      return {};
    }
  }
  if (estimates.size() < 2) {
    return estimates;
  }
  // Dispersion alone makes a per cent of difference, (n − 1)² being a coarse thing.
  constexpr double kDispersion = 0.01;
  const double rough = Pool(estimates).mean.value;
  const double tau2 = Pool(estimates, std::pow(kDispersion * rough, 2)).tau2;
  std::vector<Estimate> shared;
  for (std::size_t c = 0; c < estimates.size(); ++c) {
    // What the others say of it is a second, independent witness.
    std::vector<Estimate> others = estimates;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(c));
    Estimate said = Pool(others, tau2).mean;
    said.sigma = std::hypot(said.sigma, std::sqrt(tau2));
    shared.push_back(Pool({estimates[c], said}).mean);
    if (!IsUsable(shared.back())) {
      return {};
    }
  }
  return shared;
}

}  // namespace nacre::reconstruct::internal
