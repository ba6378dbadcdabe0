#include "reconstruct/internal/slice_features.h"

#include "core/error.h"
#include "core/random.h"
#include "core/simd_clones.h"
#include "reconstruct/internal/lanes.h"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

namespace nacre::reconstruct::internal {
namespace {

constexpr std::uint64_t kSampleStream = 0x73616D70;
constexpr int kSlicesAtOnce = 8;
// Slices whose peak has no finite inverse count as dark: denormal numbers.
constexpr float kLeastPeak = std::numeric_limits<float>::min();

// sums[slice][lane] = Σ_k shapes[slice][k] · components[k][lane], for sixteen columns.
NACRE_SIMD_CLONES void MultiplyColumns(const float* __restrict shapes,
                                       const float* __restrict components,
                                       std::size_t size,
                                       std::size_t stride,
                                       float* __restrict sums) {
  Lanes sum[kSlicesAtOnce] = {};
  for (std::size_t k = 0; k < size; ++k) {
    Lanes row;
    std::memcpy(&row, components + k * stride, sizeof row);
#pragma GCC unroll 8
    for (std::size_t s = 0; s < kSlicesAtOnce; ++s) {
      sum[s] += shapes[s * size + k] * row;
    }
  }
  std::memcpy(sums, sum, sizeof sum);
}

std::size_t Stride(int dimensions) {
  return static_cast<std::size_t>(std::int64_t{(dimensions + kLanes - 1) / kLanes} *
                                  kLanes);
}

// The largest valid value, 0 if there is none above it.
NACRE_SIMD_CLONES float PeakOf(const float* __restrict rd,
                               const std::uint8_t* __restrict valid,
                               std::size_t size) {
  float most[kLanes] = {};
  std::size_t k = 0;
  for (; k + kLanes <= size; k += kLanes) {
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const float value = valid[k + lane] != 0 ? rd[k + lane] : 0.0F;
      most[lane] = most[lane] < value ? value : most[lane];
    }
  }
  float peak = 0;
  for (; k < size; ++k) {
    peak = valid[k] != 0 ? std::max(peak, rd[k]) : peak;
  }
  return std::max(peak, *std::max_element(most, most + kLanes));
}

float Peak(std::span<const float> rd, std::span<const std::uint8_t> valid) {
  return PeakOf(rd.data(), valid.data(), rd.size());
}

// ln x of a positive normal number to 3e-7: x = m 2^e with m around 1, and
// ln m = 2 artanh((m − 1) / (m + 1)) by its series.
[[gnu::always_inline]] inline float FastLog(float x) {
  const auto bits = std::bit_cast<std::int32_t>(x);
  const std::int32_t exponent = (bits - 0x3F3504F3) >> 23;  // m from 1/√2 to √2
  const float m = std::bit_cast<float>(bits - (exponent << 23));
  const float t = (m - 1.0F) / (m + 1.0F);
  const float t2 = t * t;
  const float series =
      2.0F + t2 * (0.66666667F + t2 * (0.4F + t2 * (0.28571429F + t2 * 0.22222222F)));
  return static_cast<float>(exponent) * 0.69314718F + t * series;
}

// (ln(R'_d / peak + offset) − mean) · weight of one window; 0 where it isn't valid.
NACRE_SIMD_CLONES void LogShape(const float* __restrict rd,
                                const std::uint8_t* __restrict valid,
                                const float* __restrict mean_weight,
                                std::array<float, 2> factor_offset,
                                std::span<float> shape) {
  const std::size_t size = shape.size();
  const float* __restrict weight = mean_weight + size;
  float* __restrict out = shape.data();
  const auto [factor, offset] = factor_offset;
  for (std::size_t k = 0; k < size; ++k) {
    const float value = (rd[k] > 0.0F ? rd[k] : 0.0F) * factor + offset;
    const float one = valid[k] != 0 ? 1.0F : 0.0F;
    out[k] = one * (FastLog(value) - mean_weight[k]) * weight[k];
  }
}

}  // namespace

SliceFeatures::SliceFeatures(const RdHeader& header,
                             std::span<const RdSlice> sample,
                             double log_offset,
                             int dimensions)
    : window_(static_cast<std::size_t>(header.WindowSize())),
      offset_(static_cast<float>(log_offset)),
      mean_(static_cast<std::size_t>(header.SliceSize()), 0.0F),
      weight_(mean_.size(), 1.0F) {
  Expect(!sample.empty(), "slices to learn from");
  const std::size_t size = mean_.size();
  std::vector<double> sum(size, 0.0);
  std::vector<double> square(size, 0.0);
  std::vector<double> noise(size, 0.0);
  std::vector<double> count(size, 0.0);
  std::vector<float> shape(size);
  for (const RdSlice& slice : sample) {
    Shape(ViewOf(slice), shape);
    for (std::size_t k = 0; k < size; ++k) {
      const auto value = static_cast<double>(shape[k]);
      const double one = slice.valid[k] != 0 ? 1.0 : 0.0;
      sum[k] += one * value;
      square[k] += one * value * value;
      count[k] += one;
    }
    for (std::size_t begin = 0; begin < size; begin += window_) {
      const float peak = Peak(std::span(slice.rd).subspan(begin, window_),
                              std::span(slice.valid).subspan(begin, window_));
      for (std::size_t k = begin; peak > 0 && k < begin + window_; ++k) {
        // d ln(R/peak + o) = σ / (R + o · peak)
        const double deviation =
            slice.valid[k] != 0
                ? static_cast<double>(slice.sigma[k]) /
                      (static_cast<double>(std::max(0.0F, slice.rd[k])) +
                       static_cast<double>(offset_) * static_cast<double>(peak))
                : 0.0;
        noise[k] += deviation * deviation;
      }
    }
  }
  for (std::size_t k = 0; k < size; ++k) {
    const double n = std::max(count[k], 1.0);
    const double mean = sum[k] / n;
    const double variance = square[k] / n - mean * mean;
    mean_[k] = static_cast<float>(mean);
    weight_[k] = static_cast<float>(
        variance > 0 ? std::max(0.0, variance - noise[k] / n) / variance : 0.0);
  }
  FindComponents(sample, dimensions);
}

void SliceFeatures::Shape(const SliceView& slice, std::span<float> shape) const {
  std::vector<float> mean_weight(2 * window_);
  for (std::size_t begin = 0; begin < shape.size(); begin += window_) {
    const auto rd = slice.rd.subspan(begin, window_);
    const auto valid = slice.valid.subspan(begin, window_);
    const float peak = Peak(rd, valid);
    const auto from = static_cast<std::ptrdiff_t>(begin);
    const auto count = static_cast<std::ptrdiff_t>(window_);
    std::copy_n(mean_.begin() + from, count, mean_weight.begin());
    std::copy_n(weight_.begin() + from, count, mean_weight.begin() + count);
    LogShape(rd.data(),
             valid.data(),
             mean_weight.data(),
             {peak > kLeastPeak ? 1.0F / peak : 0.0F, offset_},
             shape.subspan(begin, window_));
  }
}

// The sample is smaller than a slice: its components follow from the eigenvectors of
// the slices' products, V = Xᵀ U / √λ.
void SliceFeatures::FindComponents(std::span<const RdSlice> sample, int dimensions) {
  const auto size = static_cast<Eigen::Index>(mean_.size());
  const auto count = std::ssize(sample);
  Eigen::MatrixXf shapes(size, count);
  for (Eigen::Index s = 0; s < count; ++s) {
    Shape(ViewOf(sample[static_cast<std::size_t>(s)]),
          {shapes.col(s).data(), static_cast<std::size_t>(size)});
  }
  Eigen::MatrixXf gram = Eigen::MatrixXf::Zero(count, count);
  gram.selfadjointView<Eigen::Lower>().rankUpdate(shapes.transpose());
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(gram.cast<double>());
  Expect(eigen.info() == Eigen::Success, "eigenvalues of a symmetric matrix");
  const double largest = eigen.eigenvalues()[count - 1];
  constexpr double kNothing = 1e-7;  // what rounding of floats makes of 0
  dimensions_ = 1;
  while (dimensions_ < std::min<std::ptrdiff_t>(dimensions, count) &&
         eigen.eigenvalues()[count - 1 - dimensions_] > kNothing * largest) {
    ++dimensions_;
  }
  const std::size_t stride = Stride(dimensions_);
  components_.assign(mean_.size() * stride, 0.0F);
  for (int d = 0; d < dimensions_ && largest > 0; ++d) {
    const Eigen::VectorXf component =
        (shapes * eigen.eigenvectors().col(count - 1 - d).cast<float>()) /
        static_cast<float>(std::sqrt(eigen.eigenvalues()[count - 1 - d]));
    for (std::size_t k = 0; k < mean_.size(); ++k) {
      components_[k * stride + static_cast<std::size_t>(d)] =
          component[static_cast<Eigen::Index>(k)];
    }
  }
}

void SliceFeatures::Project(std::span<const SliceView> slices,
                            std::span<float> features) const {
  const std::size_t size = mean_.size();
  const std::size_t stride = Stride(dimensions_);
  std::vector<float> shapes(kSlicesAtOnce * size, 0.0F);
  std::array<float, kSlicesAtOnce * kLanes> sums{};
  for (std::size_t first = 0; first < slices.size(); first += kSlicesAtOnce) {
    const std::size_t count =
        std::min<std::size_t>(kSlicesAtOnce, slices.size() - first);
    for (std::size_t s = 0; s < count; ++s) {
      Shape(slices[first + s], std::span(shapes).subspan(s * size, size));
    }
    for (std::size_t column = 0; column < stride; column += kLanes) {
      MultiplyColumns(shapes.data(), &components_[column], size, stride, sums.data());
      for (std::size_t s = 0; s < count; ++s) {
        for (std::size_t lane = 0;
             lane < kLanes && column + lane < static_cast<std::size_t>(dimensions_);
             ++lane) {
          features[(first + s) * static_cast<std::size_t>(dimensions_) + column +
                   lane] = sums[s * kLanes + lane];
        }
      }
    }
  }
}

std::vector<std::int64_t> SampleSlices(std::int64_t count,
                                       std::int64_t most,
                                       std::uint64_t seed) {
  RandomStream random(seed, kSampleStream);
  const std::int64_t taken = std::min(count, most);
  std::vector<std::int64_t> numbers;
  for (std::int64_t n = 0; n < taken; ++n) {
    const std::int64_t begin = n * count / taken;
    const std::int64_t end = (n + 1) * count / taken;
    numbers.push_back(begin + static_cast<std::int64_t>(
                                  random.Uniform() * static_cast<double>(end - begin)));
  }
  return numbers;
}

}  // namespace nacre::reconstruct::internal
