#include "factor/internal/reciprocal_rows.h"

#include <algorithm>

namespace nacre::factor::internal {
namespace {

__attribute__((target_clones("avx512f", "avx2", "default"))) void AddTriple(
    float* __restrict to,
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
                               std::size_t cell)
    : data_(data),
      fit_(fit),
      column_(channel * data.cells + cell),
      terms_(fit.Terms()),
      du_(data.OffsetX(cell)),
      dv_(data.OffsetY(cell)),
      area_(AreaOf(data, cell)),
      taps_(TapPoints(du_, dv_, fit.taps)),
      first_(static_cast<std::size_t>(terms_) * Points()),
      second_(first_.size()),
      scratch_(Points()) {}

void ReciprocalRows::Look(int y) {
  y_ = y;
  const std::size_t n = Points();
  for (int j = 0; j < terms_; ++j) {
    float* first = &first_[static_cast<std::size_t>(j) * n];
    float* second = &second_[static_cast<std::size_t>(j) * n];
    const float ends = Kernel(TapKernel(terms_, 0, j));
    std::fill_n(first, n, ends);
    std::fill_n(second, n, ends);
    for (int k = 0; k < terms_; ++k) {
      const float kernel =
          (j == k ? 2.0F : 1.0F) *
          Kernel(PairKernel(terms_, fit_.taps, std::min(j, k), std::max(j, k)));
      AddScaled(first, Map(fit_.f, k, du_, dv_), kernel, n);
      AddScaled(second, Map(fit_.f, k, 0, 0), kernel, n);
    }
  }
}

void ReciprocalRows::AddTaps(const SharedMaps& maps, float* s) const {
  for (const TapPoint& tap : taps_) {
    for (int j = 0; j < terms_; ++j) {
      AddScaled(s,
                Map(maps, j, tap.dx, tap.dy),
                tap.weight * Kernel(TapKernel(terms_, tap.tap, j)),
                Points());
    }
  }
}

void ReciprocalRows::Model(float* s) const {
  const std::size_t n = Points();
  std::fill_n(s, n, Kernel(0));
  for (int j = 0; j < terms_; ++j) {
    AddProduct(s, Map(fit_.f, j, 0, 0), &first_[static_cast<std::size_t>(j) * n], n);
    AddScaled(s, Map(fit_.f, j, du_, dv_), Kernel(TapKernel(terms_, 0, j)), n);
  }
  AddTaps(fit_.f, s);
}

void ReciprocalRows::Along(const SharedMaps& change, float* s) {
  const std::size_t n = Points();
  std::fill_n(s, n, 0.0F);
  for (int j = 0; j < terms_; ++j) {
    const std::size_t at = static_cast<std::size_t>(j) * n;
    AddProduct(s, Map(change, j, 0, 0), &first_[at], n);
    AddProduct(s, Map(change, j, du_, dv_), &second_[at], n);
  }
  AddTaps(change, s);
}

void ReciprocalRows::Back(const float* r, SharedMaps& gradient) {
  const std::size_t n = Points();
  const auto to = [&](int j, int dx, int dy) {
    return &gradient(j, static_cast<Eigen::Index>(At(y_, dx, dy)));
  };
  for (int j = 0; j < terms_; ++j) {
    const std::size_t at = static_cast<std::size_t>(j) * n;
    AddProduct(to(j, 0, 0), r, &first_[at], n);
    AddProduct(to(j, du_, dv_), r, &second_[at], n);
    for (const TapPoint& tap : taps_) {
      AddScaled(to(j, tap.dx, tap.dy),
                r,
                tap.weight * Kernel(TapKernel(terms_, tap.tap, j)),
                n);
    }
  }
}

void ReciprocalRows::Blocks(const float* w, SharedMaps& blocks) {
  const std::size_t n = Points();
  const bool is_middle = du_ == 0 && dv_ == 0;
  // Taps that touch an end count with it.
  for (const TapPoint& tap : taps_) {
    const bool at_first = tap.dx == 0 && tap.dy == 0;
    const bool at_second = tap.dx == du_ && tap.dy == dv_;
    for (int j = 0; j < terms_; ++j) {
      const float added = tap.weight * Kernel(TapKernel(terms_, tap.tap, j));
      float* first = &first_[static_cast<std::size_t>(j) * n];
      float* second = &second_[static_cast<std::size_t>(j) * n];
      for (std::size_t i = 0; i < n && (at_first || at_second); ++i) {
        (at_first ? first : second)[i] += added;
      }
    }
  }
  const auto add = [&](const std::vector<float>& v, int dx, int dy) {
    Eigen::Index row = 0;
    for (int j = 0; j < terms_; ++j) {
      for (int k = 0; k <= j; ++k) {
        AddTriple(&blocks(row++, static_cast<Eigen::Index>(At(y_, dx, dy))),
                  w,
                  &v[static_cast<std::size_t>(j) * n],
                  &v[static_cast<std::size_t>(k) * n],
                  n);
      }
    }
  };
  if (is_middle) {
    for (std::size_t i = 0; i < first_.size(); ++i) {
      first_[i] += second_[i];
    }
    add(first_, 0, 0);
    return;
  }
  add(first_, 0, 0);
  add(second_, du_, dv_);
  for (const TapPoint& tap : taps_) {
    if ((tap.dx == 0 && tap.dy == 0) || (tap.dx == du_ && tap.dy == dv_)) {
      continue;
    }
    Eigen::Index row = 0;
    for (int j = 0; j < terms_; ++j) {
      for (int k = 0; k <= j; ++k) {
        AddScaled(&blocks(row++, static_cast<Eigen::Index>(At(y_, tap.dx, tap.dy))),
                  w,
                  tap.weight * tap.weight * Kernel(TapKernel(terms_, tap.tap, j)) *
                      Kernel(TapKernel(terms_, tap.tap, k)),
                  n);
      }
    }
  }
}

}  // namespace nacre::factor::internal
