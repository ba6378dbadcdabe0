// Nonnegative factorization of the slices over their mean fall-off [Peers06, sec. 4]:
// slices are grouped, and each group's R'_d(x_i, d) / G(d) becomes Σ_j f_j(x_i) h_j(d)
// with f, h ≥ 0. What is stored is h G, so that the material is a plain sum. Where the
// paper takes the division for granted, its power is an option here: G^(q/2), q being
// the tail weight, so that the error counts as e² / G^q. HALS takes the place of
// multiplicative updates, which need ten times the rounds.

#include "core/lot_sum.h"
#include "core/parallel.h"
#include "factor/internal/hals.h"
#include "factor/internal/method.h"
#include "factor/internal/reuse.h"
#include "factor/internal/row_lots.h"
#include "reconstruct/clustering.h"

#include <algorithm>
#include <cmath>

namespace nacre::factor::internal {
namespace {

constexpr int kSampleRows = 2048;
constexpr std::int64_t kLotRows = 128;
constexpr int kRounds = 200;
constexpr int kRowSweeps = 30;
constexpr double kRankTolerance2 = 1e-5;  // of the sample's singular values

class NmfMethod final : public Method {
 public:
  explicit NmfMethod(Job& job)
      : job_(job),
        window_(job.source.header().WindowSize()),
        lots_(job.source.header().PointCount(), kLotRows),
        cluster_(static_cast<std::size_t>(job.source.header().PointCount()), 0) {
    if (job.options.clusters > 1) {
      reconstruct::Clustering clustering = ClusterSlices(job);
      cluster_ = std::move(clustering.labels);
      clusters_ = clustering.cluster_count;
    }
    for (const ChannelScan& scan : job.scans) {
      root_weight_.push_back(RootWeight(scan));
    }
    sample_ = TakeSample(job.source, kSampleRows, job.options.seed);
    std::vector<int> rank(job.scans.size(), 0);
    const RankShare own = ShareOf(std::ssize(rank), job.options.ranks);
    for (std::int64_t c = own.begin; c < own.end; ++c) {
      rank[static_cast<std::size_t>(c)] = RankOfSample(static_cast<std::size_t>(c));
    }
    JoinShares(std::ssize(rank), job.options.ranks, std::span(rank));
    most_ = std::max(1, *std::max_element(rank.begin(), rank.end()));
  }

  int MostTerms() const override { return most_; }

  Material Make(int terms) override {
    std::vector<RowMatrix> h;
    for (std::int64_t n = 0; n < std::ssize(job_.scans) * clusters_; ++n) {
      const auto [channel, k] = Matrix(n);
      Nonnegative found = FactorNonnegative(SampleRows(channel, k),
                                            MadeKernels(channel, k),
                                            {.terms = terms,
                                             .rounds = kRounds,
                                             .seed = job_.options.seed,
                                             .workers = WorkersOf(job_)});
      h.push_back(std::move(found.h));
      rounds_ += found.rounds;
    }
    if (std::ssize(sample_.rows) < job_.source.header().PointCount()) {
      Refine(h);
    }
    return Store(h, terms);
  }

  void Describe(FactorSummary& summary) const override { summary.rounds = rounds_; }

 private:
  struct Channel {
    std::size_t channel;
    int cluster;
  };

  int RankOfSample(std::size_t channel) const {
    const TruncatedSvd svd =
        ComputeTruncatedSvd(SampleRows(channel, -1), job_.options.terms, 1e-8);
    const bool is_zero = svd.sigma.size() == 0;
    return is_zero ? 0
                   : static_cast<int>(
                         (svd.sigma.array() > kRankTolerance2 * svd.sigma(0)).count());
  }

  Channel Matrix(std::int64_t n) const {
    return {static_cast<std::size_t>(n / clusters_), static_cast<int>(n % clusters_)};
  }

  // G^(−q/2).
  Eigen::VectorXd RootWeight(const ChannelScan& scan) const {
    const double largest = *std::max_element(scan.mean.begin(), scan.mean.end());
    const double scale = largest > 0 ? largest : 1;
    const std::vector<double> falloff = MeanFalloff(scan);
    Eigen::VectorXd weight(window_);
    for (Eigen::Index cell = 0; cell < window_; ++cell) {
      weight(cell) = std::pow(falloff[static_cast<std::size_t>(cell)],
                              -0.5 * job_.options.tail_weight) /
                     scale;
    }
    return weight;
  }

  // What kernels begin with: those of a material of the same clusters, or none.
  RowMatrix MadeKernels(std::size_t channel, int cluster) const {
    const Material* made = job_.made;
    if (!KeepsMaps(job_)) {
      return RowMatrix(0, window_);
    }
    RowMatrix kernels(made->terms, window_);
    for (int j = 0; j < made->terms; ++j) {
      kernels.row(j) = Eigen::Map<const Eigen::RowVectorXf>(
                           made->Kernel(static_cast<int>(channel), cluster, j), window_)
                           .cast<double>()
                           .cwiseProduct(root_weight_[channel].transpose());
    }
    return kernels;
  }

  // A row of the matrix; returns the number of cells that were filled.
  int MakeRow(const SliceBlock& block,
              std::int64_t row,
              std::size_t channel,
              double* y) const {
    const auto size = static_cast<std::size_t>(window_);
    const auto offset =
        (static_cast<std::size_t>(row) * job_.scans.size() + channel) * size;
    const int missing = FillRow({block.rd + offset, size},
                                {block.valid + offset, size},
                                job_.scans[channel],
                                {y, size});
    Eigen::Map<Eigen::VectorXd>(y, window_).array() *= root_weight_[channel].array();
    return missing;
  }

  // The sample's rows of a cluster, or, if that is negative, of all.
  RowMatrix SampleRows(std::size_t channel, int cluster) const {
    std::vector<std::int64_t> rows;
    for (std::size_t n = 0; n < sample_.rows.size(); ++n) {
      if (cluster < 0 ||
          cluster_[static_cast<std::size_t>(sample_.rows[n])] == cluster) {
        rows.push_back(static_cast<std::int64_t>(n));
      }
    }
    const SliceBlock block{0,
                           std::ssize(sample_.rows),
                           sample_.dataset.rd.data(),
                           sample_.dataset.valid.data()};
    if (rows.empty()) {  // too small a cluster: the mean slice
      RowMatrix mean(1, window_);
      for (Eigen::Index cell = 0; cell < window_; ++cell) {
        mean(0, cell) = job_.scans[channel].mean[static_cast<std::size_t>(cell)] *
                        root_weight_[channel](cell);
      }
      return mean;
    }
    RowMatrix y(std::ssize(rows), window_);
    for (Eigen::Index n = 0; n < y.rows(); ++n) {
      MakeRow(block, rows[static_cast<std::size_t>(n)], channel, &y(n, 0));
    }
    return y;
  }

  struct Rows {
    std::vector<std::int64_t> points;
    RowMatrix y;
    Eigen::MatrixXd f;
  };

  // The rows of a cluster in a block with their nonnegative coordinates. What wasn't
  // measured is predicted by these, which are then found again.
  Rows SolveRows(const SliceBlock& block, std::int64_t n, const RowMatrix& h) const {
    const auto [channel, k] = Matrix(n);
    Rows rows;
    for (std::int64_t row = 0; row < block.count; ++row) {
      if (cluster_[static_cast<std::size_t>(block.first + row)] == k) {
        rows.points.push_back(block.first + row);
      }
    }
    rows.y.resize(std::ssize(rows.points), window_);
    int missing = 0;
    for (Eigen::Index r = 0; r < rows.y.rows(); ++r) {
      const std::int64_t row = rows.points[static_cast<std::size_t>(r)] - block.first;
      missing = std::max(missing, MakeRow(block, row, channel, &rows.y(r, 0)));
    }
    const Eigen::MatrixXd gram = h * h.transpose();
    rows.f = Eigen::MatrixXd::Zero(rows.y.rows(), h.rows());
    for (int round = 0;; ++round) {
      const Eigen::MatrixXd cross = rows.y * h.transpose();
      for (int sweep = 0; sweep < kRowSweeps; ++sweep) {
        HalsSweep(gram, cross, rows.f);
      }
      if (missing == 0 || round == job_.options.fill_rounds) {
        return rows;
      }
      Predict(block, channel, h, rows);
    }
  }

  void Predict(const SliceBlock& block,
               std::size_t channel,
               const RowMatrix& h,
               Rows& rows) const {
    for (Eigen::Index r = 0; r < rows.y.rows(); ++r) {
      const std::int64_t row = rows.points[static_cast<std::size_t>(r)] - block.first;
      const std::uint8_t* valid =
          block.valid +
          (row * std::ssize(job_.scans) + static_cast<std::int64_t>(channel)) * window_;
      if (std::find(valid, valid + window_, 0) == valid + window_) {
        continue;
      }
      const Eigen::RowVectorXd predicted = rows.f.row(r) * h;
      for (Eigen::Index cell = 0; cell < window_; ++cell) {
        if (valid[cell] == 0) {
          rows.y(r, cell) = predicted(cell);
        }
      }
    }
  }

  // Calls use(matrix, rows) for every block of this rank's lots, a matrix at a time on
  // each thread, and then end_of_lot().
  template <class Use, class EndOfLot>
  void ForRows(const std::vector<RowMatrix>& h,
               const char* note,
               Use&& use,
               EndOfLot&& end_of_lot) {
    ForLots(
        job_,
        lots_,
        note,
        [&](const SliceBlock& block) {
          ParallelFor(std::ssize(h), job_.options.thread_count, [&](std::int64_t n) {
            use(static_cast<std::size_t>(n),
                SolveRows(block, n, h[static_cast<std::size_t>(n)]));
          });
        },
        end_of_lot);
  }

  // H given all rows.
  void Refine(std::vector<RowMatrix>& h) {
    // Of each matrix FᵀF above YᵀF.
    std::vector<Eigen::MatrixXd> sums;
    sums.reserve(h.size());
    for (const RowMatrix& kernels : h) {
      sums.push_back(Eigen::MatrixXd::Zero(kernels.rows() + window_, kernels.rows()));
    }
    LotSum total(lots_.count(), job_.options.ranks);
    ForRows(
        h,
        "kernels",
        [&](std::size_t n, const Rows& rows) {
          sums[n].topRows(h[n].rows()).noalias() += rows.f.transpose() * rows.f;
          sums[n].bottomRows(window_).noalias() += rows.y.transpose() * rows.f;
        },
        [&] {
          std::vector<double> values;
          for (Eigen::MatrixXd& of_lot : sums) {
            values.insert(values.end(), of_lot.data(), of_lot.data() + of_lot.size());
            of_lot.setZero();
          }
          total.Add(std::move(values));
        });
    const std::vector<double> all = total.Finish();
    const double* next = all.data();
    for (RowMatrix& kernels : h) {
      const Eigen::Index terms = kernels.rows();
      const Eigen::Map<const Eigen::MatrixXd> sum(next, terms + window_, terms);
      next += sum.size();
      Eigen::MatrixXd columns = kernels.transpose();
      for (int sweep = 0; sweep < kRowSweeps; ++sweep) {
        HalsSweep(sum.topRows(terms), sum.bottomRows(window_), columns);
      }
      kernels = columns.transpose();
    }
  }

  Material Store(const std::vector<RowMatrix>& h, int terms) {
    const auto points = static_cast<std::size_t>(job_.source.header().PointCount());
    const auto term_count = static_cast<std::size_t>(terms);
    const auto window = static_cast<std::size_t>(window_);
    Material m = EmptyMaterial(job_.source.header());
    m.terms = terms;
    m.cluster = cluster_;
    m.cluster_count = clusters_;
    m.f.assign(job_.scans.size() * term_count * points, 0.0F);
    m.h.assign(h.size() * term_count * window, 0.0F);
    const auto store = [&](std::size_t n, const Rows& rows) {
      const std::size_t channel = n / static_cast<std::size_t>(clusters_);
      for (Eigen::Index j = 0; j < rows.f.cols(); ++j) {
        float* map =
            &m.f[(channel * term_count + static_cast<std::size_t>(j)) * points];
        for (std::size_t r = 0; r < rows.points.size(); ++r) {
          map[rows.points[r]] =
              static_cast<float>(rows.f(static_cast<Eigen::Index>(r), j));
        }
      }
    };
    ForRows(h, "maps", store, [] {});
    JoinMaps(job_, lots_, m.f);
    std::vector<double> sizes = Normalize(m);
    for (std::size_t n = 0; n < h.size(); ++n) {
      const std::size_t channel = n / static_cast<std::size_t>(clusters_);
      for (Eigen::Index j = 0; j < h[n].rows(); ++j) {
        const double size = sizes[channel * term_count + static_cast<std::size_t>(j)];
        for (std::size_t cell = 0; cell < window; ++cell) {
          const auto at = static_cast<Eigen::Index>(cell);
          m.h[(n * term_count + static_cast<std::size_t>(j)) * window + cell] =
              static_cast<float>(h[n](j, at) / root_weight_[channel](at) * size);
        }
      }
    }
    return m;
  }

  // Gives each map a mean square of 1; returns what its kernels take instead.
  static std::vector<double> Normalize(Material& m) {
    const auto points = static_cast<std::size_t>(m.PointCount());
    std::vector<double> sizes(m.f.size() / points, 1);
    for (std::size_t n = 0; n < sizes.size(); ++n) {
      double squares = 0;
      for (std::size_t p = 0; p < points; ++p) {
        const auto value = static_cast<double>(m.f[n * points + p]);
        squares += value * value;
      }
      if (squares > 0) {
        sizes[n] = std::sqrt(squares / static_cast<double>(points));
        for (std::size_t p = 0; p < points; ++p) {
          float& value = m.f[n * points + p];
          value = static_cast<float>(static_cast<double>(value) / sizes[n]);
        }
      }
    }
    return sizes;
  }

  Job& job_;
  Eigen::Index window_;
  RowLots lots_;
  std::vector<std::uint8_t> cluster_;
  int clusters_ = 1;
  int most_ = 1;
  int rounds_ = 0;
  Sample sample_;
  std::vector<Eigen::VectorXd> root_weight_;  // [channel]
};

}  // namespace

std::unique_ptr<Method> MakeNmfMethod(Job& job) {
  return std::make_unique<NmfMethod>(job);
}

}  // namespace nacre::factor::internal
