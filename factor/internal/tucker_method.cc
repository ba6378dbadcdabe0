// The Tucker model [Kurt13; Oenel14, sec. 4.2]: the mean over channels of each slice,
// shifted so that its maximum comes first and divided by it [Xu11], is factored with
// terms each fitted to what those before leave; what makes a channel of the mean is a
// polynomial whose coefficients are found for each row by least squares.

#include "core/error.h"
#include "core/lot_sum.h"
#include "core/parallel.h"
#include "factor/internal/method.h"
#include "factor/internal/row_basis.h"
#include "factor/internal/row_lots.h"
#include "factor/internal/tucker.h"
#include "factor/internal/tucker_als.h"

#include <Eigen/QR>

#include <algorithm>
#include <cmath>

namespace nacre::factor::internal {
namespace {

constexpr Eigen::Index kPanelColumns = 64;
constexpr std::int64_t kLotRows = 128;
constexpr std::int64_t kMostLots = 16;  // Gram matrices are large

Job& Checked(Job& job) {
  if (job.options.clusters > 1) {
    throw UsageError(
        "option clusters: the Tucker model has no clusters; log-svd, svd, sqrt-svd and "
        "nmf have");
  }
  return job;
}

class TuckerMethod final : public Method {
 public:
  explicit TuckerMethod(Job& job)
      : job_(Checked(job)),
        header_(job.source.header()),
        window_(header_.WindowSize()),
        lots_(header_.PointCount(), kLotRows, kMostLots),
        channels_(header_.channels.size()) {
    kernels_ = TuckerKernels(
        SumRows(),
        header_.core,
        {.terms = job.options.terms, .window_rank = WindowRank(), .on_round = {}});
  }

  int MostTerms() const override {
    return std::max(1, static_cast<int>(kernels_.cols()));
  }

  Material Make(int terms) override {
    Material m = EmptyMaterial(header_);
    m.form = Form::kTucker;
    m.terms = terms;
    m.order = job_.options.polynomial;
    m.f.assign(static_cast<std::size_t>(m.MapCount() * m.MapSize()), 0.0F);
    const Eigen::MatrixXd kernels =
        kernels_.leftCols(std::min<Eigen::Index>(terms, kernels_.cols()));
    m.h.assign(static_cast<std::size_t>(terms * window_), 0.0F);
    std::transform(
        kernels.data(), kernels.data() + kernels.size(), m.h.begin(), [](double value) {
          return static_cast<float>(value);
        });
    const Eigen::MatrixXd to_coordinates = CoordinatesOf(kernels);
    const auto store = [&](const SliceBlock& block) {
      ParallelFor(block.count, job_.options.thread_count, [&](std::int64_t row) {
        StoreRow(block, row, to_coordinates, m);
      });
    };
    ForLots(job_, lots_, "maps", store, [] {});
    JoinMaps(job_, lots_, m.f);
    return m;
  }

  void Describe(FactorSummary&) const override {}

 private:
  int WindowRank() const {
    const int wanted = job_.options.window_rank;
    return wanted == 0 ? header_.core : std::min(wanted, header_.core);
  }

  // All channels of a row, a column each, missing values filled.
  Eigen::MatrixXd Channels(const SliceBlock& block, std::int64_t row) const {
    const auto size = static_cast<std::size_t>(window_);
    Eigen::MatrixXd values(window_, static_cast<Eigen::Index>(channels_));
    for (std::size_t c = 0; c < channels_; ++c) {
      const auto offset = (static_cast<std::size_t>(row) * channels_ + c) * size;
      FillRow({block.rd + offset, size},
              {block.valid + offset, size},
              job_.scans[c],
              {values.col(static_cast<Eigen::Index>(c)).data(), size});
    }
    return values;
  }

  struct Row {
    Eigen::VectorXd shifted;
    std::int64_t shift = 0;
  };

  // The mean over channels, its maximum first and 1.
  Row MakeRow(const Eigen::MatrixXd& channels) const {
    const Eigen::VectorXd mean = channels.rowwise().mean();
    Eigen::Index largest = 0;
    const double maximum = mean.maxCoeff(&largest);
    Row row{Eigen::VectorXd::Zero(window_), largest};
    if (maximum > 0) {
      for (Eigen::Index cell = 0; cell < window_; ++cell) {
        row.shifted(ShiftedCell(header_.core, largest, cell)) = mean(cell) / maximum;
      }
    }
    return row;
  }

  // YᵀY of the rows, its lower triangle.
  Eigen::MatrixXd SumRows() {
    GramSum sum(window_);
    const Eigen::Index panels = (window_ + kPanelColumns - 1) / kPanelColumns;
    const auto add = [&](const SliceBlock& block) {
      RowMatrix y(block.count, window_);
      ParallelFor(block.count, job_.options.thread_count, [&](std::int64_t r) {
        const Row row = MakeRow(Channels(block, r));
        y.row(r) = row.shifted.transpose();
      });
      const Eigen::VectorXd weight = Eigen::VectorXd::Ones(block.count);
      ParallelFor(panels, job_.options.thread_count, [&](std::int64_t panel) {
        const Eigen::Index column = panel * kPanelColumns;
        sum.AddPanel(y, weight, column, std::min(kPanelColumns, window_ - column));
      });
    };
    LotSum total(lots_.count(), job_.options.ranks);
    ForLots(job_, lots_, "sums", add, [&] {
      std::vector<double> columns;
      for (Eigen::Index k = 0; k < window_; ++k) {
        columns.insert(
            columns.end(), &sum.gram(k, k), sum.gram.col(k).data() + window_);
      }
      sum.gram.setZero();
      total.Add(std::move(columns));
    });
    const std::vector<double> all = total.Finish();
    const double* next = all.data();
    for (Eigen::Index k = 0; k < window_; next += window_ - k, ++k) {
      std::copy_n(next, window_ - k, &sum.gram(k, k));
    }
    return std::move(sum.gram);
  }

  void StoreRow(const SliceBlock& block,
                std::int64_t row,
                const Eigen::MatrixXd& to_coordinates,
                Material& m) const {
    const std::int64_t point = block.first + row;
    const auto store = [&](int map, double value) {
      m.f[static_cast<std::size_t>(map * m.MapSize() + point)] =
          static_cast<float>(value);
    };
    const Eigen::MatrixXd channels = Channels(block, row);
    const Row made = MakeRow(channels);
    store(TuckerShiftMap(m), static_cast<double>(made.shift));
    const Eigen::VectorXd f = to_coordinates.transpose() * made.shifted;
    for (Eigen::Index t = 0; t < f.size(); ++t) {
      store(static_cast<int>(t), f(t));
    }
    // The polynomial is fitted to what the material will make of the row.
    Eigen::MatrixXd powers(window_, m.order + 1);
    Eigen::VectorXd intensity(window_);
    TuckerIntensity(
        m,
        {static_cast<int>(point % m.points_x), static_cast<int>(point / m.points_x)},
        intensity.data());
    powers.col(0).setOnes();
    for (int power = 1; power <= m.order; ++power) {
      powers.col(power) = powers.col(power - 1).cwiseProduct(intensity);
    }
    for (int c = 0; c < static_cast<int>(channels_); ++c) {
      const Eigen::VectorXd a = Polynomial(block, row, c, powers, channels.col(c));
      for (int power = 0; power <= m.order; ++power) {
        store(TuckerCoefficientMap(m, c, power), a(power));
      }
    }
  }

  // The coefficients of a channel, by its measured cells.
  Eigen::VectorXd Polynomial(const SliceBlock& block,
                             std::int64_t row,
                             std::int64_t channel,
                             const Eigen::MatrixXd& powers,
                             const Eigen::VectorXd& values) const {
    const std::uint8_t* valid =
        block.valid + (row * static_cast<std::int64_t>(channels_) + channel) * window_;
    if (std::find(valid, valid + window_, 0) == valid + window_) {
      return powers.colPivHouseholderQr().solve(values);
    }
    Eigen::VectorXd used(window_);
    std::copy_n(valid, window_, used.data());
    if (used.isZero()) {
      used.setOnes();  // nothing is known: the mean slice, as filled
    }
    const Eigen::MatrixXd masked = used.asDiagonal() * powers;
    return masked.colPivHouseholderQr().solve(values.cwiseProduct(used));
  }

  Job& job_;
  const reconstruct::RdHeader& header_;
  Eigen::Index window_;
  RowLots lots_;
  std::size_t channels_;
  Eigen::MatrixXd kernels_;
};

}  // namespace

std::unique_ptr<Method> MakeTuckerMethod(Job& job) {
  return std::make_unique<TuckerMethod>(job);
}

}  // namespace nacre::factor::internal
