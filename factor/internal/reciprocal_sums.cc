#include "factor/internal/reciprocal_sums.h"

#include "core/parallel.h"
#include "core/rank_shares.h"
#include "factor/internal/reciprocal_taps.h"
#include "factor/internal/row_streams.h"

#include <algorithm>
#include <cstdint>

namespace nacre::factor::internal {
namespace {

// Offsets are dealt to this many sums, which are added in their order.
constexpr std::size_t kGroups = 8;

// One offset and channel of a material: rows of pairs (p, p + d), p before p + d in the
// window of p.
class OffsetRows {
 public:
  // `scale`: row_scale of the channel, as wide as maps, or null: 1 everywhere.
  OffsetRows(const Material& m, int channel, std::int64_t cell, const float* scale)
      : m_(m),
        scale_(scale),
        du_(static_cast<int>(cell) % m.core - (m.core - 1) / 2),
        dv_(static_cast<int>(cell) / m.core - (m.core - 1) / 2),
        taps_(TapPoints(du_, dv_, m.taps)) {
    for (int k = 0; k < m.KernelCount(); ++k) {
      kernels_.push_back(m.Kernel(channel, 0, k)[cell]);
    }
    for (int j = 0; j < m.terms; ++j) {
      for (int k = 0; k < m.terms; ++k) {
        pairs_.push_back(
            (j == k ? 2.0F : 1.0F) *
            Kernel(PairKernel(m.terms, m.taps, std::min(j, k), std::max(j, k))));
      }
    }
  }

  // Pairs whose first point is in row y (of the maps), and that have a point on the
  // grid.
  void Add(int y, double* totals) {
    const int x0 = std::max(0, -du_);
    const int x1 = m_.MapWidth() - std::max(0, du_);
    if (y + dv_ < 0 || y + dv_ >= m_.MapHeight() || x1 <= x0) {
      return;
    }
    y_ = y;
    x0_ = x0;
    count_ = static_cast<std::size_t>(x1 - x0);
    model_.resize(count_);
    there_.resize(count_);
    Model();
    if (scale_ != nullptr) {
      const float* here = scale_ + std::int64_t{y} * m_.MapWidth() + x0;
      const float* there = here + std::int64_t{dv_} * m_.MapWidth() + du_;
      for (std::size_t i = 0; i < count_; ++i) {
        model_[i] *= here[i] * there[i];
      }
    }
    AddSide(0, 0, false, totals);
    if (du_ != 0 || dv_ != 0) {
      AddSide(du_, dv_, true, totals);
    }
  }

 private:
  float Kernel(int k) const { return kernels_[static_cast<std::size_t>(k)]; }
  const float* Map(int map, int dx, int dy) const {
    return m_.FactorMap(0, map) + std::int64_t{y_ + dy} * m_.MapWidth() + x0_ + dx;
  }

  // R_d of the pairs over A, without scales and sides.
  void Model() {
    rows_.clear();
    weights_.clear();
    const auto list = [&](const float* row, float weight) {
      rows_.push_back(row);
      weights_.push_back(weight);
    };
    for (const TapPoint& tap : taps_) {
      for (int j = 0; j < m_.terms; ++j) {
        list(Map(j, tap.dx, tap.dy),
             tap.weight * Kernel(TapKernel(m_.terms, tap.tap, j)));
      }
    }
    const int rest = ReciprocalKernelCount(m_.terms, m_.taps);
    for (int k = 0; k < m_.rest; ++k) {
      list(Map(m_.terms + k, 0, 0), Kernel(rest + k));
    }
    for (int j = 0; j < m_.terms; ++j) {
      const float ends = Kernel(TapKernel(m_.terms, 0, j));
      list(Map(j, 0, 0), ends);
      list(Map(j, du_, dv_), ends);
    }
    LinearCombination(
        rows_.data(), weights_.data(), rows_.size(), Kernel(0), count_, model_.data());
    rows_.clear();
    for (int k = 0; k < m_.terms; ++k) {
      rows_.push_back(Map(k, du_, dv_));
    }
    for (int j = 0; j < m_.terms; ++j) {
      LinearCombination(rows_.data(),
                        &pairs_[static_cast<std::size_t>(std::int64_t{j} * m_.terms)],
                        rows_.size(),
                        0,
                        count_,
                        there_.data());
      const float* here = Map(j, 0, 0);
      const float* there = there_.data();
      AddProducts(&here, &there, 1, count_, model_.data());
    }
    ExpRow(static_cast<float>(kMostLog), count_, model_.data());
  }

  // What the pairs are in the windows of their first points, or of their second.
  void AddSide(int dx, int dy, bool is_second, double* totals) {
    const int row = y_ + dy - m_.margin;
    const int first = std::max(x0_ + dx, m_.margin);
    const int last =
        std::min(x0_ + dx + static_cast<int>(count_), m_.margin + m_.points_x);
    if (row < 0 || row >= m_.points_y || last <= first) {
      return;
    }
    const float* model = model_.data();
    if (m_.sides > 0) {
      constexpr auto kMost = static_cast<float>(kMostSide);
      const float g = (is_second ? -1.0F : 1.0F) * Kernel(m_.KernelCount() - 1);
      const float* here = Map(m_.MapCount() - 1, 0, 0);
      const float* there = Map(m_.MapCount() - 1, du_, dv_);
      for (std::size_t i = 0; i < count_; ++i) {
        there_[i] = std::clamp(g * (here[i] - there[i]), -kMost, kMost);
      }
      ExpRow(kMost, count_, there_.data());
      for (std::size_t i = 0; i < count_; ++i) {
        there_[i] *= model[i];
      }
      model = there_.data();
    }
    AddToSums(model + (first - x0_ - dx),
              static_cast<std::size_t>(last - first),
              totals + std::int64_t{row} * m_.points_x + first - m_.margin);
  }

  const Material& m_;
  const float* scale_;
  int du_;
  int dv_;
  std::vector<TapPoint> taps_;
  std::vector<float> kernels_;
  std::vector<float> pairs_;
  int y_ = 0;
  int x0_ = 0;
  std::size_t count_ = 0;
  std::vector<const float*> rows_;
  std::vector<float> weights_;
  std::vector<float> model_;
  std::vector<float> there_;
};

// Of one channel as wide as the maps, 1 beyond the grid; empty if it is 1 everywhere.
std::vector<float> WideScale(const Material& m, int channel) {
  const float* scale = &m.row_scale[static_cast<std::size_t>(channel * m.PointCount())];
  if (std::all_of(scale, scale + m.PointCount(), [](float s) { return s == 1; })) {
    return {};
  }
  std::vector<float> wide(static_cast<std::size_t>(m.MapSize()), 1.0F);
  for (int j = 0; j < m.points_y; ++j) {
    std::copy_n(scale + std::int64_t{j} * m.points_x,
                m.points_x,
                wide.begin() + std::int64_t{j + m.margin} * m.MapWidth() + m.margin);
  }
  return wide;
}

}  // namespace

std::vector<double> ReciprocalTotals(const Material& m, const Workers& workers) {
  const auto points = static_cast<std::size_t>(m.PointCount());
  const std::size_t channels = m.channels.size();
  const auto cells = static_cast<std::size_t>(m.WindowSize() + 1) / 2;
  const RankShare share = ShareOf(kGroups, workers.ranks);
  std::vector<std::vector<double>> sums(
      static_cast<std::size_t>(share.end - share.begin));
  std::vector<double> totals(channels * points, 0.0);
  for (std::size_t c = 0; c < channels; ++c) {
    const std::vector<float> scale = WideScale(m, static_cast<int>(c));
    ParallelFor(std::ssize(sums), workers.thread_count, [&](std::int64_t own) {
      std::vector<double>& sum = sums[static_cast<std::size_t>(own)];
      sum.assign(points, 0.0);
      std::vector<OffsetRows> offsets;
      for (auto cell = static_cast<std::size_t>(share.begin + own); cell < cells;
           cell += kGroups) {
        offsets.emplace_back(m,
                             static_cast<int>(c),
                             static_cast<std::int64_t>(cell),
                             scale.empty() ? nullptr : scale.data());
      }
      for (int y = 0; y < m.MapHeight(); ++y) {
        for (OffsetRows& offset : offsets) {
          offset.Add(y, sum.data());
        }
      }
      for (double& value : sum) {
        value *= m.a[c];
      }
    });
    const std::vector<std::span<const double>> own(sums.begin(), sums.end());
    SumInOrder<double>(
        kGroups, own, workers.ranks, std::span(totals).subspan(c * points, points));
  }
  return totals;
}

}  // namespace nacre::factor::internal
