// Maps of the reciprocal model, given its kernels.

#include "core/parallel.h"
#include "core/rank_shares.h"
#include "core/simd_clones.h"
#include "factor/internal/reciprocal_fit.h"
#include "factor/internal/reciprocal_rows.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>
#include <functional>

namespace nacre::factor::internal {
namespace {

// Offsets are dealt to this many sums, which are added in their order: the bits don't
// depend on the number of threads and ranks.
constexpr std::size_t kGroups = 8;
constexpr int kMostSteps = 8;     // of conjugate gradients
constexpr double kEnough = 1e-3;  // of the squared residual, preconditioned
constexpr float kMostChange = 2;  // of a logarithm
// Inverse variance of a map's value. Weights take 1 % for noise (kTolerance), some ten
// times what it is: this is what a variance of 1 means in their units.
constexpr double kPrior = 0.01;

// `s` has a number a pair of the row.
using RowWork = std::function<void(ReciprocalRows& rows,
                                   std::size_t pairs,
                                   float share,
                                   std::vector<float>& s,
                                   SharedMaps& sum)>;

// A held offset of a channel: where its pairs begin, and their share.
struct HeldRows {
  ReciprocalRows rows;
  std::size_t pairs;
  float share;
};

// Calls `work` for each row of each held offset and channel, `pairs` being where the
// row's begin, and adds up what it adds to `sum`, of `height` rows. Offsets of a group
// take turns at each row of points, so that the maps' rows stay at hand.
SharedMaps OverRows(const ReciprocalData& data,
                    const ReciprocalFit& fit,
                    Eigen::Index height,
                    const Workers& workers,
                    const RowWork& work) {
  const auto plane = static_cast<Eigen::Index>(data.Plane());
  const RankShare share = ShareOf(kGroups, workers.ranks);
  std::vector<SharedMaps> sums(static_cast<std::size_t>(share.end - share.begin),
                               SharedMaps::Zero(height, plane));
  ParallelFor(std::ssize(sums), workers.thread_count, [&](std::int64_t own) {
    const auto g = static_cast<std::size_t>(share.begin + own);
    RowScratch scratch;
    std::vector<float> s;
    std::vector<HeldRows> offsets;
    for (std::size_t n = g; n < data.held.size(); n += kGroups) {
      for (std::size_t c = 0; c < data.channels; ++c) {
        const auto cell = static_cast<std::size_t>(data.held[n]);
        offsets.push_back({ReciprocalRows(data, fit, c, cell, scratch),
                           data.HeldOffset(c, n),
                           data.share[n]});
      }
    }
    for (int y = 0; y < data.height; ++y) {
      for (HeldRows& held : offsets) {
        const PlaneArea& area = held.rows.area();
        if (y < area.y0 || y >= area.y1) {
          continue;
        }
        held.rows.Look(y);
        s.resize(held.rows.Points());
        work(held.rows,
             held.pairs +
                 static_cast<std::size_t>(std::int64_t{y} * data.width + area.x0),
             held.share,
             s,
             sums[static_cast<std::size_t>(own)]);
      }
    }
  });
  std::vector<std::span<const float>> own;
  own.reserve(sums.size());
  for (const SharedMaps& sum : sums) {
    own.emplace_back(sum.data(), static_cast<std::size_t>(sum.size()));
  }
  SharedMaps total(height, plane);
  const std::span all(total.data(), static_cast<std::size_t>(total.size()));
  SumInOrder<float>(kGroups, own, workers.ranks, all);
  return total;
}

NACRE_SIMD_CLONES void Multiply(const float* __restrict by,
                                std::size_t n,
                                float* __restrict s) {
  for (std::size_t i = 0; i < n; ++i) {
    s[i] *= by[i];
  }
}

// Of models `s`: the weights of their changes and, in their place, what residuals pull
// with.
NACRE_SIMD_CLONES void LinearizeRow(const float* __restrict value,
                                    const float* __restrict weight,
                                    float share,
                                    std::size_t n,
                                    float* __restrict changes,
                                    float* __restrict s) {
  for (std::size_t i = 0; i < n; ++i) {
    const float modelled = s[i];
    const float w = share * weight[i] * modelled;
    const float most = kMostChange * modelled;
    changes[i] = w * modelled;
    s[i] = w * std::min(std::max(value[i] - modelled, -most), most);
  }
}

// The weights of changes of the logarithm, and what residuals pull with.
struct Linearized {
  std::vector<float> weight;  ///< [pair]; of other ranks' offsets 0
  SharedMaps pull;
};

Linearized Linearize(const ReciprocalData& data,
                     const ReciprocalFit& fit,
                     const Workers& workers) {
  Linearized result;
  result.weight.assign(data.pairs.value.size(), 0.0F);
  result.pull = OverRows(data,
                         fit,
                         fit.f.rows(),
                         workers,
                         [&](ReciprocalRows& rows,
                             std::size_t at,
                             float share,
                             std::vector<float>& s,
                             SharedMaps& sum) {
                           rows.Model(s.data());
                           ExpRow(static_cast<float>(kMostLog), s.size(), s.data());
                           LinearizeRow(&data.pairs.value[at],
                                        &data.pairs.weight[at],
                                        share,
                                        s.size(),
                                        &result.weight[at],
                                        s.data());
                           rows.Back(s.data(), sum);
                         });
  return result;
}

// Inverses of each point's own block of the normal equations, and its prior.
class Preconditioner {
 public:
  Preconditioner(const ReciprocalData& data,
                 const ReciprocalFit& fit,
                 const std::vector<float>& weight,
                 const Workers& workers)
      : terms_(fit.f.rows()),
        thread_count_(workers.thread_count),
        blocks_(OverRows(data,
                         fit,
                         terms_ * (terms_ + 1) / 2,
                         workers,
                         [&](ReciprocalRows& rows,
                             std::size_t at,
                             float,
                             std::vector<float>&,
                             SharedMaps& sum) { rows.Blocks(&weight[at], sum); })) {
    ParallelForBlocks(
        blocks_.cols(), 4096, thread_count_, [&](std::int64_t p0, std::int64_t p1) {
          for (std::int64_t p = p0; p < p1; ++p) {
            Store(p, Block(p).llt().solve(Eigen::MatrixXd::Identity(terms_, terms_)));
          }
        });
  }

  SharedMaps Apply(const SharedMaps& r) const {
    SharedMaps result = SharedMaps::Zero(r.rows(), r.cols());
    ParallelForBlocks(
        r.cols(), 4096, thread_count_, [&](std::int64_t p0, std::int64_t p1) {
          Eigen::Index row = 0;
          for (Eigen::Index j = 0; j < terms_; ++j) {
            for (Eigen::Index k = 0; k <= j; ++k, ++row) {
              const auto n = static_cast<std::size_t>(p1 - p0);
              AddProduct(&result(j, p0), &blocks_(row, p0), &r(k, p0), n);
              if (j != k) {
                AddProduct(&result(k, p0), &blocks_(row, p0), &r(j, p0), n);
              }
            }
          }
        });
    return result;
  }

 private:
  Eigen::MatrixXd Block(Eigen::Index p) const {
    Eigen::MatrixXd block(terms_, terms_);
    Eigen::Index row = 0;
    for (Eigen::Index j = 0; j < terms_; ++j) {
      for (Eigen::Index k = 0; k <= j; ++k, ++row) {
        block(j, k) = static_cast<double>(blocks_(row, p));
        block(k, j) = block(j, k);
      }
    }
    block.diagonal().array() += kPrior + 1e-6 * block.trace();
    return block;
  }

  void Store(Eigen::Index p, const Eigen::MatrixXd& inverse) {
    Eigen::Index row = 0;
    for (Eigen::Index j = 0; j < terms_; ++j) {
      for (Eigen::Index k = 0; k <= j; ++k, ++row) {
        blocks_(row, p) = static_cast<float>(inverse(j, k));
      }
    }
  }

  Eigen::Index terms_;
  int thread_count_;
  SharedMaps blocks_;
};

}  // namespace

MapChange MapStep(const ReciprocalData& data,
                  const ReciprocalFit& fit,
                  const Workers& workers) {
  const Linearized linear = Linearize(data, fit, workers);
  const Preconditioner preconditioner(data, fit, linear.weight, workers);
  const auto normal = [&](const SharedMaps& change) -> SharedMaps {
    return static_cast<float>(kPrior) * change +
           OverRows(data,
                    fit,
                    fit.f.rows(),
                    workers,
                    [&](ReciprocalRows& rows,
                        std::size_t at,
                        float,
                        std::vector<float>& s,
                        SharedMaps& sum) {
                      rows.Along(change, s.data());
                      Multiply(&linear.weight[at], s.size(), s.data());
                      rows.Back(s.data(), sum);
                    });
  };
  SharedMaps step = SharedMaps::Zero(fit.f.rows(), fit.f.cols());
  const SharedMaps pull = linear.pull - static_cast<float>(kPrior) * fit.f;
  SharedMaps r = pull;
  SharedMaps z = preconditioner.Apply(r);
  SharedMaps p = z;
  double rz = Dot(r, z);
  const double enough = kEnough * rz;
  for (int n = 0; n < kMostSteps && rz > enough; ++n) {
    const SharedMaps ap = normal(p);
    const double curvature = Dot(p, ap);
    if (!(curvature > 0)) {
      break;
    }
    const auto length = static_cast<float>(rz / curvature);
    step += length * p;
    r -= length * ap;
    z = preconditioner.Apply(r);
    const double next = Dot(r, z);
    p = z + static_cast<float>(next / rz) * p;
    rz = next;
  }
  return {step, pull};
}

void SetHeldWeights(const ReciprocalFit& fit, int thread_count, ReciprocalData& data) {
  ParallelFor(std::ssize(data.held), thread_count, [&](std::int64_t held) {
    const auto n = static_cast<std::size_t>(held);
    std::vector<float> s;
    RowScratch scratch;
    for (std::size_t c = 0; c < data.channels; ++c) {
      ReciprocalRows rows(
          data, fit, c, static_cast<std::size_t>(data.held[n]), scratch);
      s.resize(rows.Points());
      for (int y = rows.area().y0; y < rows.area().y1; ++y) {
        rows.Look(y);
        rows.Model(s.data());
        float* weight =
            &data.pairs
                 .weight[data.HeldOffset(c, n) +
                         static_cast<std::size_t>(y * data.width + rows.area().x0)];
        for (std::size_t i = 0; i < s.size(); ++i) {
          weight[i] = WeightOf(weight[i],
                               std::exp(std::min(static_cast<double>(s[i]), kMostLog)),
                               data.tail_weight);
        }
      }
    }
  });
  // Pairs that no area has: nothing was measured there.
  for (float& weight : data.pairs.weight) {
    weight = std::max(weight, 0.0F);
  }
}

}  // namespace nacre::factor::internal
