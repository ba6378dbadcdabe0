// Fits R'_d = √(P(x_i) P(x_o)) [Song09, sec. 4], P a sum of Gaussians at each point.

#include "factor/internal/profiles_fit.h"

#include "core/parallel.h"
#include "core/rank_shares.h"
#include "factor/internal/nonnegative_solve.h"
#include "reconstruct/error_figures.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace nacre::factor::internal {
namespace {

// How far the profile at the other end may be from a point's own. Gaussians that one
// end lacks altogether would else take the fit anywhere.
constexpr double kMostRatio = 8;
constexpr double kPrior = 1e-3;  // of a point's own equations, for those of the margin

// The Gaussians' values at an offset.
using Values = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostGaussians, 1>;

// The normal equations of one point.
struct Equations {
  Eigen::Index terms;
  std::array<double, kMostGaussians * kMostGaussians> gram{};  // the lower triangle
  std::array<double, kMostGaussians> cross{};

  explicit Equations(Eigen::Index term_count) : terms(term_count) {}

  void Add(const Values& a, double value, double weight) {
    for (Eigen::Index i = 0; i < terms; ++i) {
      const double weighted = weight * a(i);
      for (Eigen::Index j = 0; j <= i; ++j) {
        gram[static_cast<std::size_t>(i * kMostGaussians + j)] += weighted * a(j);
      }
      cross[static_cast<std::size_t>(i)] += weighted * value;
    }
  }
  // Pulls the unknowns towards `prior`.
  void AddPrior(const Values& strength, const Values& prior) {
    for (Eigen::Index i = 0; i < terms; ++i) {
      gram[static_cast<std::size_t>(i * (kMostGaussians + 1))] += strength(i);
      cross[static_cast<std::size_t>(i)] += strength(i) * prior(i);
    }
  }
  Eigen::MatrixXd Gram() const {
    Eigen::MatrixXd full(terms, terms);
    for (Eigen::Index i = 0; i < terms; ++i) {
      for (Eigen::Index j = 0; j <= i; ++j) {
        full(i, j) = full(j, i) =
            gram[static_cast<std::size_t>(i * kMostGaussians + j)];
      }
    }
    return full;
  }
  Eigen::VectorXd Cross() const {
    return Eigen::Map<const Eigen::VectorXd>(cross.data(), terms);
  }
  Eigen::VectorXd Solve() const { return SolveNonnegative(Gram(), Cross()); }
};

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
    for (const double b : beta) {
      gaussians.emplace_back(b, header_.Radius(), header_.pitch_mm);
    }
    Equations equations(terms);
    double squares = 0;
    Values a(terms);
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

class ProfilesFit {
 public:
  ProfilesFit(Job& job, const std::vector<ProfileBasis>& bases)
      : job_(job),
        header_(job.source.header()),
        bases_(bases),
        terms_(static_cast<Eigen::Index>(bases.front().gaussians.size())),
        radius_(header_.Radius()),
        width_(header_.points_x + 2 * radius_),
        height_(header_.points_y + 2 * radius_),
        own_(ShareOf(height_, job.options.ranks)),
        w_(bases.size() * static_cast<std::size_t>(terms_) * MapSize(), 0.0F) {
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) {
        if (!InGrid(x - radius_, y - radius_)) {
          outside_.push_back({x - radius_, y - radius_});
          if (y >= own_.begin && y < own_.end) {
            own_outside_.push_back(outside_.back());
          }
        }
      }
    }
  }

  std::vector<float> Run(int rounds) {
    for (int round = 0; round < rounds; ++round) {
      Round(round == 0);
    }
    return std::move(w_);
  }

 private:
  std::size_t MapSize() const {
    return static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
  }
  bool InGrid(int i, int j) const {
    return i >= 0 && i < header_.points_x && j >= 0 && j < header_.points_y;
  }
  float& W(std::size_t channel, Eigen::Index term, GridIndex p, std::vector<float>& w) {
    return w[(channel * static_cast<std::size_t>(terms_) +
              static_cast<std::size_t>(term)) *
                 MapSize() +
             static_cast<std::size_t>((p.y + radius_) * width_ + p.x + radius_)];
  }

  double Profile(std::size_t channel, GridIndex p, const Values& a) {
    double sum = 0;
    for (Eigen::Index t = 0; t < terms_; ++t) {
      sum += static_cast<double>(W(channel, t, p, w_)) * a(t);
    }
    return sum;
  }

  // √(P of the other end / P of the point itself), which both are scaled by together.
  double Ratio(std::size_t channel, GridIndex self, GridIndex other, const Values& a) {
    const double own = Profile(channel, self, a);
    const double there = Profile(channel, other, a);
    if (!(own > 0) || !(there > 0)) {
      return 1;
    }
    return std::clamp(std::sqrt(there / own), 1 / kMostRatio, kMostRatio);
  }

  // A measurement of the pair, for the profile of `self`.
  void AddPair(std::size_t channel,
               const SliceBlock& block,
               GridIndex from,
               GridIndex to,
               bool self_is_from,
               bool is_first,
               Equations& equations) {
    const GridIndex d{to.x - from.x, to.y - from.y};
    const std::int64_t cell =
        std::int64_t{d.y + radius_} * header_.core + d.x + radius_;
    const std::int64_t row =
        std::int64_t{from.y} * header_.points_x + from.x - block.first;
    const std::int64_t at = row * header_.SliceSize() +
                            static_cast<std::int64_t>(channel) * header_.WindowSize() +
                            cell;
    if (block.valid[at] == 0) {
      return;
    }
    Values a(terms_);
    for (Eigen::Index t = 0; t < terms_; ++t) {
      a(t) = bases_[channel].gaussians[static_cast<std::size_t>(t)].At(d.x, d.y);
    }
    if (!is_first) {
      a *= self_is_from ? Ratio(channel, from, to, a) : Ratio(channel, to, from, a);
    }
    equations.Add(a,
                  static_cast<double>(block.rd[at]),
                  bases_[channel].weight[static_cast<std::size_t>(cell)]);
  }

  void Round(bool is_first) {
    std::vector<float> next = w_;
    std::vector<Equations> outside;
    if (!is_first) {
      outside.assign(bases_.size() * own_outside_.size(), Equations(terms_));
    }
    const RankShare inside = PointsOf(own_);
    const RankShare read =
        is_first ? inside : PointsOf({own_.begin - radius_, own_.end + radius_});
    for (std::int64_t first = read.begin; first < read.end; first += kBlockRows) {
      Report(job_.progress,
             {"factor", first - read.begin, read.end - read.begin, "profiles"});
      const SliceBlock block =
          job_.source.Read(first, std::min(kBlockRows, read.end - first));
      ParallelFor(block.count, job_.options.thread_count, [&](std::int64_t row) {
        if (first + row >= inside.begin && first + row < inside.end) {
          FitInside(block, row, is_first, next);
        }
      });
      ParallelFor(std::ssize(outside), job_.options.thread_count, [&](std::int64_t n) {
        const auto at = static_cast<std::size_t>(n);
        GatherOutside(block,
                      at / own_outside_.size(),
                      own_outside_[at % own_outside_.size()],
                      outside[at]);
      });
    }
    w_ = std::move(next);
    Join();
    ExtendInside();
    for (std::size_t n = 0; n < outside.size(); ++n) {
      SolveOutside(
          n / own_outside_.size(), own_outside_[n % own_outside_.size()], outside[n]);
    }
    if (!is_first) {
      Join();
    }
    ++job_.passes;
  }

  // The grid's points in rows of the maps, margins counted.
  RankShare PointsOf(RankShare rows) const {
    const auto point = [&](std::int64_t y) {
      return std::clamp<std::int64_t>(y - radius_, 0, header_.points_y) *
             header_.points_x;
    };
    return {point(rows.begin), point(rows.end)};
  }

  void Join() {
    JoinPlanes(std::ssize(bases_) * terms_, height_, job_.options.ranks, std::span(w_));
  }

  void FitInside(const SliceBlock& block,
                 std::int64_t row,
                 bool is_first,
                 std::vector<float>& next) {
    const std::int64_t point = block.first + row;
    const GridIndex p{static_cast<int>(point % header_.points_x),
                      static_cast<int>(point / header_.points_x)};
    for (std::size_t c = 0; c < bases_.size(); ++c) {
      Equations equations(terms_);
      for (int v = -radius_; v <= radius_; ++v) {
        for (int u = -radius_; u <= radius_; ++u) {
          AddPair(c, block, p, {p.x + u, p.y + v}, true, is_first, equations);
        }
      }
      const Eigen::VectorXd w = equations.Solve();
      for (Eigen::Index t = 0; t < terms_; ++t) {
        W(c, t, p, next) = static_cast<float>(w(t));
      }
    }
  }

  // What the block's slices say of a point of the margin.
  void GatherOutside(const SliceBlock& block,
                     std::size_t channel,
                     GridIndex to,
                     Equations& equations) {
    const auto columns = static_cast<std::int64_t>(header_.points_x);
    const int first_row = static_cast<int>(block.first / columns);
    const int last_row = static_cast<int>((block.first + block.count - 1) / columns);
    for (int j = std::max(first_row, to.y - radius_);
         j <= std::min(last_row, to.y + radius_);
         ++j) {
      for (int i = std::max(0, to.x - radius_);
           i <= std::min(header_.points_x - 1, to.x + radius_);
           ++i) {
        const std::int64_t slice = j * columns + i;
        if (slice >= block.first && slice < block.first + block.count) {
          AddPair(channel, block, {i, j}, to, false, false, equations);
        }
      }
    }
  }

  // Points of the margin start, and stay where nothing is known, as the grid's nearest.
  void ExtendInside() {
    for (std::size_t c = 0; c < bases_.size(); ++c) {
      for (const GridIndex p : outside_) {
        const GridIndex nearest{std::clamp(p.x, 0, header_.points_x - 1),
                                std::clamp(p.y, 0, header_.points_y - 1)};
        for (Eigen::Index t = 0; t < terms_; ++t) {
          W(c, t, p, w_) = W(c, t, nearest, w_);
        }
      }
    }
  }

  void SolveOutside(std::size_t channel, GridIndex p, Equations& equations) {
    Values prior(terms_);
    Values strength = Values::Zero(terms_);
    for (Eigen::Index t = 0; t < terms_; ++t) {
      prior(t) = static_cast<double>(W(channel, t, p, w_));
    }
    const ProfileBasis& basis = bases_[channel];
    for (std::size_t cell = 0; cell < basis.weight.size(); ++cell) {
      const auto n = static_cast<int>(cell);
      for (Eigen::Index t = 0; t < terms_; ++t) {
        const double g = basis.gaussians[static_cast<std::size_t>(t)].At(
            n % header_.core - radius_, n / header_.core - radius_);
        strength(t) += kPrior * basis.weight[cell] * g * g;
      }
    }
    equations.AddPrior(strength, prior);
    const Eigen::VectorXd w = equations.Solve();
    for (Eigen::Index t = 0; t < terms_; ++t) {
      W(channel, t, p, w_) = static_cast<float>(w(t));
    }
  }

  Job& job_;
  const reconstruct::RdHeader& header_;
  const std::vector<ProfileBasis>& bases_;
  Eigen::Index terms_;
  int radius_;
  int width_;
  int height_;
  RankShare own_;  // rows of the maps that this rank finds, margins counted
  std::vector<GridIndex> outside_;
  std::vector<GridIndex> own_outside_;
  std::vector<float> w_;
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

std::vector<float> FitProfiles(Job& job,
                               const std::vector<ProfileBasis>& bases,
                               int rounds) {
  return ProfilesFit(job, bases).Run(rounds);
}

}  // namespace nacre::factor::internal
