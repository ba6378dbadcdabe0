#include "reconstruct/internal/glare_pyramid.h"

#include "core/simd_clones.h"
#include "reconstruct/internal/lanes.h"

#include <Eigen/QR>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <span>

namespace nacre::reconstruct::internal {
namespace {

// A Gaussian is convolved at the coarsest level where it is that many bins wide.
constexpr double kBinsASigma = 1.25;
constexpr int kSmallestPicture = 4;  // bins a side

double Density(double r2, double variance) {
  return std::exp(-0.5 * r2 / variance) / (2 * std::numbers::pi * variance);
}

// Side of a level's bins, pixels.
int SideAt(int level) {
  return BinnedPicture::kSide << level;
}

// What boxes at the finest level and tents from level to level, both there and back,
// do to a Gaussian's variance, pixels².
double VarianceAdded(int level) {
  double variance = (SideAt(0) * SideAt(0) - 1) / 6.0;
  for (int l = 1; l <= level; ++l) {
    variance += 3.0 / 8 * SideAt(l) * SideAt(l);
  }
  return variance;
}

// The sum of K over a picture's reach, pixel by pixel.
double Sum(const calibrate::Glare& glare, int reach) {
  double sum = 0;
  for (int y = 0; y <= reach; ++y) {
    for (int x = 1; x <= reach; ++x) {  // a quarter of the plane, and its axis
      const double r = std::hypot(x, y);
      sum += r <= reach ? 4 * glare.DensityAt(r) : 0;
    }
  }
  return sum;
}

// Distances at which the sum of Gaussians is to agree: by half a pixel beside the hole,
// then by shares, and beyond the reach, where K ends.
std::vector<double> FitRadii(double hole_px, double reach_px) {
  std::vector<double> radii;
  for (double r = 0.5; r < 3 * reach_px; r = r < 3 * hole_px ? r + 0.5 : r * 1.06) {
    radii.push_back(r);
  }
  return radii;
}

// out[x] = Σ_t taps[t] · in[x + t · step] for `kVectors` vectors from x on; taps are
// symmetric. So many sums side by side needn't wait for one another.
template <std::size_t kVectors>
[[gnu::always_inline]] inline void SumTaps(const float* __restrict in,
                                           std::size_t step,
                                           std::span<const float> taps,
                                           float* __restrict out) {
  using Vectors = Lanes[kVectors];
  const std::size_t last = taps.size() - 1;
  Vectors sum;
  std::memcpy(&sum, in + last / 2 * step, sizeof sum);
  for (Lanes& lanes : sum) {
    lanes *= taps[last / 2];
  }
  for (std::size_t t = 0; t < last / 2; ++t) {
    Vectors one;
    Vectors other;
    std::memcpy(&one, in + t * step, sizeof one);
    std::memcpy(&other, in + (last - t) * step, sizeof other);
    for (std::size_t v = 0; v < kVectors; ++v) {
      sum[v] += taps[t] * (one[v] + other[v]);
    }
  }
  std::memcpy(out, &sum, sizeof sum);
}

// The same of a multiple of kLanes values.
NACRE_SIMD_CLONES void ApplyTaps(const float* __restrict in,
                                 std::size_t step,
                                 std::span<const float> taps,
                                 std::size_t count,
                                 float* __restrict out) {
  std::size_t x = 0;
  for (; x + 4 * kLanes <= count; x += 4 * kLanes) {
    SumTaps<4>(in + x, step, taps, out + x);
  }
  for (; x < count; x += kLanes) {
    SumTaps<1>(in + x, step, taps, out + x);
  }
}

}  // namespace

GlarePyramid::GlarePyramid(const calibrate::Glare& glare, int width_px, int height_px) {
  if (glare.empty()) {
    return;
  }
  // What is scattered farther than half a picture is spread too thin to matter.
  const int reach_px = std::max(width_px, height_px) / 2;
  const int side_px = std::min(width_px, height_px);
  fraction_ = Sum(glare, reach_px);
  for (double sigma = kBinsASigma * SideAt(0); sigma < 0.7 * reach_px;
       sigma *= std::numbers::sqrt2) {
    int level = 0;
    while (kBinsASigma * SideAt(level + 1) <= sigma * 1.001 &&
           side_px / SideAt(level + 1) >= kSmallestPicture) {
      ++level;
    }
    gaussians_.push_back({sigma, 0.0, {}, level});
    level_count_ = level + 1;
  }
  FitWeights(glare, reach_px);
  for (Gaussian& gaussian : gaussians_) {
    const double side = SideAt(gaussian.level);
    const double variance =
        (gaussian.sigma_px * gaussian.sigma_px - VarianceAdded(gaussian.level)) /
        (side * side);
    const int radius = static_cast<int>(std::ceil(3.5 * std::sqrt(variance)));
    double sum = 0;
    for (int t = -radius; t <= radius; ++t) {
      sum += std::exp(-0.5 * t * t / variance);
    }
    for (int t = -radius; t <= radius; ++t) {
      gaussian.taps.push_back(
          static_cast<float>(std::exp(-0.5 * t * t / variance) / sum));
    }
  }
}

// In units of Σ C: (1 − g + K) ∗ C = K / (1 − g), solved by fixed-point steps, each of
// which gains a factor g; the least squares fit of relative errors, an octave like any
// other, keeps C a sum of the same Gaussians.
void GlarePyramid::FitWeights(const calibrate::Glare& glare, double reach_px) {
  const double hole_px = glare.radius_px.front();
  const std::vector<double> radii = FitRadii(hole_px, reach_px);
  const auto rows = static_cast<Eigen::Index>(radii.size());
  const auto columns = static_cast<Eigen::Index>(gaussians_.size());
  const double kept = 1 - fraction_;
  const auto variance = [&](Eigen::Index k) {
    return std::pow(gaussians_[static_cast<std::size_t>(k)].sigma_px, 2);
  };
  Eigen::MatrixXd shape(rows + 1, columns);
  Eigen::VectorXd kernel(rows);
  Eigen::VectorXd scale(rows);
  for (Eigen::Index n = 0; n < rows; ++n) {
    const double r = radii[static_cast<std::size_t>(n)];
    const double next =
        n + 1 < rows ? radii[static_cast<std::size_t>(n) + 1] : 1.06 * r;
    const double edge = std::clamp(r, hole_px, reach_px);
    scale[n] = std::sqrt((next - r) / edge) / glare.DensityAt(edge);
    kernel[n] = r <= reach_px ? glare.DensityAt(r) : 0;
    for (Eigen::Index k = 0; k < columns; ++k) {
      shape(n, k) = scale[n] * Density(r * r, variance(k));
    }
  }
  constexpr double kSumCounts = 0.1;
  shape.row(rows).setConstant(kSumCounts / fraction_);
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> solver(shape);
  const auto fit = [&](const Eigen::VectorXd& target, double sum) {
    Eigen::VectorXd right(rows + 1);
    right.head(rows) = scale.cwiseProduct(target);
    right[rows] = kSumCounts / fraction_ * sum;
    return Eigen::VectorXd(solver.solve(right));
  };
  const Eigen::VectorXd once = fit(kernel, fraction_);  // K
  Eigen::VectorXd weights = once / (kept * kept);
  constexpr int kSteps = 5;
  for (int step = 0; step < kSteps; ++step) {
    Eigen::VectorXd target = kernel / kept;
    for (Eigen::Index n = 0; n < rows; ++n) {
      const double r = radii[static_cast<std::size_t>(n)];
      for (Eigen::Index a = 0; a < columns; ++a) {
        for (Eigen::Index b = 0; b < columns; ++b) {
          target[n] -= once[a] * weights[b] * Density(r * r, variance(a) + variance(b));
        }
      }
    }
    weights = fit(target / kept, fraction_ / kept);
  }
  for (Eigen::Index k = 0; k < columns; ++k) {
    gaussians_[static_cast<std::size_t>(k)].weight = weights[k];
  }
}

void GlarePyramid::Convolve(int level,
                            const BinnedPicture& sums,
                            BinnedPicture& result) const {
  const auto width = static_cast<std::size_t>(sums.width);
  const auto height = static_cast<std::size_t>(sums.height);
  const std::size_t stride = (width + kLanes - 1) / kLanes * kLanes;
  std::fill(result.values.begin(), result.values.end(), 0.0F);
  std::vector<float> row(stride);
  for (const Gaussian& gaussian : gaussians_) {
    if (gaussian.level != level) {
      continue;
    }
    const std::size_t radius = gaussian.taps.size() / 2;
    // Rows with dark ones above and below.
    std::vector<float> along((height + 2 * radius) * stride, 0.0F);
    std::vector<float> line(stride + 2 * radius, 0.0F);
    for (std::size_t y = 0; y < height; ++y) {
      std::copy_n(&sums.values[y * width], width, &line[radius]);
      ApplyTaps(line.data(), 1, gaussian.taps, stride, &along[(y + radius) * stride]);
    }
    const auto scale = static_cast<float>(gaussian.weight / std::pow(SideAt(level), 2));
    for (std::size_t y = 0; y < height; ++y) {
      ApplyTaps(&along[y * stride], stride, gaussian.taps, stride, row.data());
      AddScaled(row.data(), scale, width, &result.values[y * width]);
    }
  }
}

BinnedPicture GlarePyramid::Scattered(BinnedPicture sums) const {
  std::vector<BinnedPicture> levels;
  levels.push_back(std::move(sums));
  for (int level = 1; level < level_count_; ++level) {
    const BinnedPicture finer = WithRim(levels.back());
    BinnedPicture coarser(finer.width, finer.height);
    Shrink(finer, coarser);
    levels.push_back(std::move(coarser));
  }
  BinnedPicture result = levels.back();
  for (int level = level_count_; level-- > 0;) {
    BinnedPicture own = levels[static_cast<std::size_t>(level)];
    Convolve(level, levels[static_cast<std::size_t>(level)], own);
    if (level + 1 < level_count_) {
      BinnedPicture grown =
          BinnedPicture::OfSize(own.width + 2 * kDarkRim, own.height + 2 * kDarkRim);
      AddGrown(result, grown);
      AddWithoutRim(grown, own);
    }
    result = std::move(own);
  }
  return result;
}

}  // namespace nacre::reconstruct::internal
