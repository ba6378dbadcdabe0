#include "factor/internal/reciprocal_rows.h"

#include "core/simd_clones.h"

#include <algorithm>

namespace nacre::factor::internal {
namespace {

NACRE_SIMD_CLONES void AddTriple(float* __restrict to,
                                 const float* __restrict a,
                                 const float* __restrict b,
                                 const float* __restrict c,
                                 std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) {
    to[i] += a[i] * b[i] * c[i];
  }
}

}  // namespace

ReciprocalRows::ReciprocalRows(const ReciprocalData& data,
                               const ReciprocalFit& fit,
                               std::size_t channel,
                               std::size_t cell,
                               RowScratch& scratch)
    : maps_(fit.f),
      scratch_(scratch),
      width_(data.width),
      terms_(fit.Terms()),
      du_(data.OffsetX(cell)),
      dv_(data.OffsetY(cell)),
      area_(AreaOf(data, cell)),
      taps_(TapPoints(du_, dv_, fit.taps)) {
  const auto column = static_cast<Eigen::Index>(channel * data.cells + cell);
  for (Eigen::Index k = 0; k < fit.h.rows(); ++k) {
    kernels_.push_back(static_cast<float>(fit.h(k, column)));
  }
  for (int j = 0; j < terms_; ++j) {
    end_weights_.push_back(Kernel(TapKernel(terms_, 0, j)));
    for (int k = 0; k < terms_; ++k) {
      pairs_.push_back(
          (j == k ? 2.0F : 1.0F) *
          Kernel(PairKernel(terms_, fit.taps, std::min(j, k), std::max(j, k))));
    }
  }
  for (const TapPoint& tap : taps_) {
    for (int j = 0; j < terms_; ++j) {
      tap_weights_.push_back(tap.weight * Kernel(TapKernel(terms_, tap.tap, j)));
    }
  }
}

void ReciprocalRows::Look(int y) {
  y_ = y;
  const std::size_t n = Points();
  const std::size_t size = n * static_cast<std::size_t>(terms_);
  if (scratch_.first.size() < size) {
    scratch_.first.resize(size);
    scratch_.second.resize(size);
  }
  std::vector<const float*>& here = scratch_.a;
  std::vector<const float*>& there = scratch_.b;
  here.clear();
  there.clear();
  for (int k = 0; k < terms_; ++k) {
    here.push_back(Map(maps_, k, 0, 0));
    there.push_back(Map(maps_, k, du_, dv_));
  }
  for (int j = 0; j < terms_; ++j) {
    const float* pairs = &pairs_[static_cast<std::size_t>(std::int64_t{j} * terms_)];
    const float ends = end_weights_[static_cast<std::size_t>(j)];
    LinearCombination(there.data(), pairs, there.size(), ends, n, First(j));
    LinearCombination(here.data(), pairs, here.size(), ends, n, Second(j));
  }
}

void ReciprocalRows::ListTaps(const SharedMaps& maps) const {
  scratch_.a.clear();
  for (const TapPoint& tap : taps_) {
    for (int j = 0; j < terms_; ++j) {
      scratch_.a.push_back(Map(maps, j, tap.dx, tap.dy));
    }
  }
}

void ReciprocalRows::Model(float* s) const {
  const std::size_t n = Points();
  ListTaps(maps_);
  LinearCombination(
      scratch_.a.data(), tap_weights_.data(), scratch_.a.size(), Kernel(0), n, s);
  scratch_.a.clear();
  scratch_.b.clear();
  for (int j = 0; j < terms_; ++j) {
    scratch_.a.push_back(Map(maps_, j, 0, 0));
    scratch_.b.push_back(First(j));
    AddScaled(s, Map(maps_, j, du_, dv_), end_weights_[static_cast<std::size_t>(j)], n);
  }
  AddProducts(scratch_.a.data(), scratch_.b.data(), scratch_.a.size(), n, s);
}

void ReciprocalRows::Along(const SharedMaps& change, float* s) const {
  const std::size_t n = Points();
  ListTaps(change);
  LinearCombination(scratch_.a.data(), tap_weights_.data(), scratch_.a.size(), 0, n, s);
  scratch_.a.clear();
  scratch_.b.clear();
  for (int j = 0; j < terms_; ++j) {
    scratch_.a.push_back(Map(change, j, 0, 0));
    scratch_.b.push_back(First(j));
    scratch_.a.push_back(Map(change, j, du_, dv_));
    scratch_.b.push_back(Second(j));
  }
  AddProducts(scratch_.a.data(), scratch_.b.data(), scratch_.a.size(), n, s);
}

void ReciprocalRows::Back(const float* r, SharedMaps& gradient) const {
  const auto to = [&](int j, int dx, int dy) {
    return &gradient(j, static_cast<Eigen::Index>(At(y_, dx, dy)));
  };
  std::vector<Sink>& sinks = scratch_.sinks;
  sinks.clear();
  for (int j = 0; j < terms_; ++j) {
    sinks.push_back({to(j, 0, 0), First(j), 0});
    sinks.push_back({to(j, du_, dv_), Second(j), 0});
  }
  const float* weight = tap_weights_.data();
  for (const TapPoint& tap : taps_) {
    for (int j = 0; j < terms_; ++j) {
      sinks.push_back({to(j, tap.dx, tap.dy), nullptr, *weight++});
    }
  }
  AddToSinks(sinks.data(), sinks.size(), r, Points());
}

void ReciprocalRows::AddBlock(
    const float* w, const float* v, int dx, int dy, SharedMaps& blocks) const {
  const std::size_t n = Points();
  Eigen::Index row = 0;
  for (int j = 0; j < terms_; ++j) {
    for (int k = 0; k <= j; ++k) {
      AddTriple(&blocks(row++, static_cast<Eigen::Index>(At(y_, dx, dy))),
                w,
                v + static_cast<std::size_t>(j) * n,
                v + static_cast<std::size_t>(k) * n,
                n);
    }
  }
}

void ReciprocalRows::Blocks(const float* w, SharedMaps& blocks) {
  const std::size_t n = Points();
  std::vector<Sink>& sinks = scratch_.sinks;
  sinks.clear();
  for (std::size_t t = 0; t < taps_.size(); ++t) {
    const TapPoint& tap = taps_[t];
    const float* weights = &tap_weights_[t * static_cast<std::size_t>(terms_)];
    const bool at_first = tap.dx == 0 && tap.dy == 0;
    const bool at_second = tap.dx == du_ && tap.dy == dv_;
    Eigen::Index row = 0;
    for (int j = 0; j < terms_; ++j) {
      // Taps that touch an end count with it.
      float* end = at_first ? First(j) : Second(j);
      for (std::size_t i = 0; i < n && (at_first || at_second); ++i) {
        end[i] += weights[j];
      }
      for (int k = 0; k <= j && !at_first && !at_second; ++k) {
        sinks.push_back(
            {&blocks(row++, static_cast<Eigen::Index>(At(y_, tap.dx, tap.dy))),
             nullptr,
             weights[j] * weights[k]});
      }
    }
  }
  AddToSinks(sinks.data(), sinks.size(), w, n);
  if (du_ == 0 && dv_ == 0) {  // one point twice
    float* first = First(0);
    const float* second = Second(0);
    for (std::size_t i = 0; i < n * static_cast<std::size_t>(terms_); ++i) {
      first[i] += second[i];
    }
    AddBlock(w, First(0), 0, 0, blocks);
    return;
  }
  AddBlock(w, First(0), 0, 0, blocks);
  AddBlock(w, Second(0), du_, dv_, blocks);
}

}  // namespace nacre::factor::internal
