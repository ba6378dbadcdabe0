// Fits R'_d = √(P(x_i) P(x_o)) [Song09, sec. 4], P a sum of Gaussians at each point.

#include "factor/internal/profiles_fit.h"

#include "core/parallel.h"
#include "core/rank_shares.h"
#include "factor/internal/profile_equations.h"

#include <algorithm>
#include <cmath>

namespace nacre::factor::internal {
namespace {

// How far the profile at the other end may be from a point's own. Gaussians that one
// end lacks altogether would else take the fit anywhere.
constexpr double kMostRatio = 8;
constexpr double kPrior = 1e-3;  // of a point's own equations, for those of the margin

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
      is_first_ = round == 0;
      Round();
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

  double Profile(std::size_t channel, GridIndex p, const GaussianValues& a) {
    double sum = 0;
    for (Eigen::Index t = 0; t < terms_; ++t) {
      sum += static_cast<double>(W(channel, t, p, w_)) * a(t);
    }
    return sum;
  }

  // √(P of the other end / P of the point itself), which both are scaled by together.
  double Ratio(std::size_t channel,
               GridIndex self,
               GridIndex other,
               const GaussianValues& a) {
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
               ProfileEquations& equations) {
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
    GaussianValues a(terms_);
    for (Eigen::Index t = 0; t < terms_; ++t) {
      a(t) = bases_[channel].gaussians[static_cast<std::size_t>(t)].At(d.x, d.y);
    }
    if (!is_first_) {
      a *= self_is_from ? Ratio(channel, from, to, a) : Ratio(channel, to, from, a);
    }
    equations.Add(a,
                  static_cast<double>(block.rd[at]),
                  bases_[channel].weight[static_cast<std::size_t>(cell)]);
  }

  void Round() {
    std::vector<float> next = w_;
    std::vector<ProfileEquations> outside;
    if (!is_first_) {
      outside.assign(bases_.size() * own_outside_.size(), ProfileEquations(terms_));
    }
    const RankShare inside = PointsOf(own_);
    const RankShare read =
        is_first_ ? inside : PointsOf({own_.begin - radius_, own_.end + radius_});
    for (std::int64_t first = read.begin; first < read.end; first += kBlockRows) {
      Report(job_.progress,
             {"factor", first - read.begin, read.end - read.begin, "profiles"});
      const SliceBlock block =
          job_.source.Read(first, std::min(kBlockRows, read.end - first));
      ParallelFor(block.count, job_.options.thread_count, [&](std::int64_t row) {
        if (first + row >= inside.begin && first + row < inside.end) {
          FitInside(block, row, next);
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
    if (!is_first_) {
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

  void FitInside(const SliceBlock& block, std::int64_t row, std::vector<float>& next) {
    const std::int64_t point = block.first + row;
    const GridIndex p{static_cast<int>(point % header_.points_x),
                      static_cast<int>(point / header_.points_x)};
    for (std::size_t c = 0; c < bases_.size(); ++c) {
      ProfileEquations equations(terms_);
      for (int v = -radius_; v <= radius_; ++v) {
        for (int u = -radius_; u <= radius_; ++u) {
          AddPair(c, block, p, {p.x + u, p.y + v}, true, equations);
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
                     ProfileEquations& equations) {
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
          AddPair(channel, block, {i, j}, to, false, equations);
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

  void SolveOutside(std::size_t channel, GridIndex p, ProfileEquations& equations) {
    GaussianValues prior(terms_);
    GaussianValues strength = GaussianValues::Zero(terms_);
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
  bool is_first_ = true;  // round
  RankShare own_;         // rows of the maps that this rank finds, margins counted
  std::vector<GridIndex> outside_;
  std::vector<GridIndex> own_outside_;
  std::vector<float> w_;
};

}  // namespace

std::vector<float> FitProfiles(Job& job,
                               const std::vector<ProfileBasis>& bases,
                               int rounds) {
  return ProfilesFit(job, bases).Run(rounds);
}

}  // namespace nacre::factor::internal
