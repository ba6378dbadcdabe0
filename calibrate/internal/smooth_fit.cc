#include "calibrate/internal/smooth_fit.h"

#include "calibrate/internal/one_thread_algebra.h"
#include "core/error.h"

#include <opencv2/core.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace nacre::calibrate::internal {

namespace {

// A block of `picture`, or what of it lies in it.
Block BlockMean(const std::vector<float>& picture,
                int width,
                cv::Rect block,
                const std::vector<bool>& excluded) {
  const int height = static_cast<int>(std::ssize(picture)) / width;
  Block mean;
  double u = 0;
  double v = 0;
  for (int y = block.y; y < std::min(block.y + block.height, height); ++y) {
    for (int x = block.x; x < std::min(block.x + block.width, width); ++x) {
      const auto k = static_cast<std::size_t>(std::int64_t{y} * width + x);
      if (excluded.empty() || !excluded[k]) {
        mean.mean += static_cast<double>(picture[k]);
        u += 2 * (x + 0.5) / width - 1;
        v += 2 * (y + 0.5) / height - 1;
        ++mean.count;
      }
    }
  }
  if (mean.count > 0) {
    mean.mean /= mean.count;
    mean.u = u / mean.count;
    mean.v = v / mean.count;
  }
  return mean;
}

}  // namespace

std::vector<Block> BlockMeans(const std::vector<float>& picture,
                              int width,
                              int side,
                              const std::vector<bool>& excluded) {
  const int height = static_cast<int>(std::ssize(picture)) / width;
  std::vector<Block> blocks;
  for (int top = 0; top < height; top += side) {
    for (int left = 0; left < width; left += side) {
      const Block block = BlockMean(picture, width, {left, top, side, side}, excluded);
      if (block.count > 0) {
        blocks.push_back(block);
      }
    }
  }
  return blocks;
}

SmoothField FitSmoothField(const std::vector<Block>& blocks, int degree) {
  const int terms = (degree + 1) * (degree + 2) / 2;
  Expect(std::ssize(blocks) > terms, "more blocks than terms");
  cv::Mat_<double> normal(terms, terms, 0.0);
  cv::Mat_<double> right(terms, 1, 0.0);
  std::vector<double> term(static_cast<std::size_t>(terms));
  for (const Block& block : blocks) {
    std::size_t k = 0;
    for (int d = 0; d <= degree; ++d) {
      for (int j = 0; j <= d; ++j) {
        term[k++] = std::pow(block.u, d - j) * std::pow(block.v, j);
      }
    }
    for (int a = 0; a < terms; ++a) {
      const double weighted = block.count * term[static_cast<std::size_t>(a)];
      right(a, 0) += weighted * block.mean;
      for (int b = 0; b < terms; ++b) {
        normal(a, b) += weighted * term[static_cast<std::size_t>(b)];
      }
    }
  }
  const OneThreadAlgebra one_thread;
  cv::Mat_<double> solution;
  cv::solve(normal, right, solution, cv::DECOMP_SVD);
  SmoothField field{.degree = degree};
  field.coefficients.assign(solution.begin(), solution.end());
  const auto n = static_cast<double>(blocks.size());
  field.sigma = ResidualRms(blocks, field) * std::sqrt(terms / (n - terms));
  return field;
}

double ResidualRms(const std::vector<Block>& blocks, const SmoothField& field) {
  double sum = 0;
  double weight = 0;
  for (const Block& block : blocks) {
    const double residual = block.mean - field.At(block.u, block.v);
    sum += block.count * residual * residual;
    weight += block.count;
  }
  return std::sqrt(sum / weight);
}

}  // namespace nacre::calibrate::internal
