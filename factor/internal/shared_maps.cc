#include "factor/internal/shared_maps.h"

#include "core/simd_clones.h"

#include <algorithm>

namespace nacre::factor::internal {

void ExtendMaps(int width, int height, int margin, SharedMaps& maps) {
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const int from_x = std::clamp(x, margin, width - 1 - margin);
      const int from_y = std::clamp(y, margin, height - 1 - margin);
      maps.col(y * width + x) = maps.col(from_y * width + from_x);
    }
  }
}

double Dot(const SharedMaps& a, const SharedMaps& b) {
  double sum = 0;
  for (Eigen::Index n = 0; n < a.size(); ++n) {
    sum += static_cast<double>(a.data()[n]) * static_cast<double>(b.data()[n]);
  }
  return sum;
}

namespace {

NACRE_SIMD_CLONES void AddScaledClones(float* __restrict to,
                                       const float* __restrict a,
                                       float b,
                                       std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) {
    to[i] += a[i] * b;
  }
}

NACRE_SIMD_CLONES void AddProductClones(float* __restrict to,
                                        const float* __restrict a,
                                        const float* __restrict b,
                                        std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) {
    to[i] += a[i] * b[i];
  }
}

}  // namespace

void AddScaled(float* __restrict to,
               const float* __restrict a,
               float b,
               std::size_t n) {
  AddScaledClones(to, a, b, n);
}

void AddProduct(float* __restrict to,
                const float* __restrict a,
                const float* __restrict b,
                std::size_t n) {
  AddProductClones(to, a, b, n);
}

}  // namespace nacre::factor::internal
