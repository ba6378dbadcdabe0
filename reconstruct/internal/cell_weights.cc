#include "reconstruct/internal/cell_weights.h"

#include <algorithm>
#include <cmath>

namespace nacre::reconstruct::internal {
namespace {

// Pixel edges are drawn straight in the sample plane; what distortion bends them by is
// far below this share of a cell.
constexpr double kFullCover = 0.999;

constexpr int kLanes = 16;  // pixels a vector

// A symmetric filter of five pixels along each axis: undoes a Gaussian blur of variance
// σ² in pixels. To fourth order in the derivatives that is
// 1 − σ²/2 ∂² + σ⁴/8 ∂⁴, and ∂² = D₂ − D₄/12 by differences of pixels.
struct Sharpener {
  explicit Sharpener(double variance_px2) {
    const double first = 0.5 * variance_px2;
    const double second = 0.5 * first * first + first / 12;
    outer = second;
    inner = -first - 4 * second;
    middle = 1 + 2 * first + 6 * second;
  }
  double outer;
  double inner;
  double middle;
};

// The weights of the pixels around one cell, dense: a filter of the picture is the same
// filter of the weights, since it is symmetric.
class WeightBox {
 public:
  // Room for slopes and the filter around the pixels of the pieces.
  static constexpr int kMargin = 3;

  WeightBox(const PixelPiece* const* pieces, std::size_t count) {
    int right = 0;
    int bottom = 0;
    left_ = pieces[0]->column;
    top_ = pieces[0]->row;
    for (std::size_t n = 0; n < count; ++n) {
      left_ = std::min(left_, pieces[n]->column);
      right = std::max(right, pieces[n]->column);
      top_ = std::min(top_, pieces[n]->row);
      bottom = std::max(bottom, pieces[n]->row);
    }
    left_ -= kMargin;
    top_ -= kMargin;
    width_ = right - left_ + 1 + kMargin;
    height_ = bottom - top_ + 1 + kMargin;
    weights_.assign(
        static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_), 0.0);
    for (std::size_t n = 0; n < count; ++n) {
      Add(*pieces[n]);
    }
  }

  void Sharpen(const Sharpener& along_x, const Sharpener& along_y) {
    for (int y = 0; y < height_; ++y) {
      Filter(along_x, Index(0, y), 1, width_);
    }
    for (int x = 0; x < width_; ++x) {
      Filter(along_y, Index(x, 0), static_cast<std::size_t>(width_), height_);
    }
  }

  // The rows of the box that lie in the picture, as visit(row, first column, weights);
  // what lies beyond the picture's rim is its rim.
  template <class Visit>
  void ForEachRow(const calibrate::CameraGeometry& camera, Visit&& visit) const {
    const int left = std::clamp(left_, 0, camera.width_px - 1);
    const int right = std::clamp(left_ + width_ - 1, left, camera.width_px - 1);
    const int top = std::clamp(top_, 0, camera.height_px - 1);
    const int bottom = std::clamp(top_ + height_ - 1, top, camera.height_px - 1);
    std::vector<float> row(static_cast<std::size_t>(right - left + 1));
    for (int to = top; to <= bottom; ++to) {
      std::fill(row.begin(), row.end(), 0.0F);
      for (int y = 0; y < height_; ++y) {
        if (std::clamp(top_ + y, top, bottom) != to) {
          continue;
        }
        for (int x = 0; x < width_; ++x) {
          row[static_cast<std::size_t>(std::clamp(left_ + x, left, right) - left)] +=
              static_cast<float>(weights_[Index(x, y)]);
        }
      }
      visit(to, left, row);
    }
  }

 private:
  std::size_t Index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
           static_cast<std::size_t>(x);
  }

  void Add(const PixelPiece& piece) {
    const int x = piece.column - left_;
    const int y = piece.row - top_;
    weights_[Index(x, y)] += piece.share;
    weights_[Index(x + 1, y)] += 0.5 * piece.share * piece.du;
    weights_[Index(x - 1, y)] -= 0.5 * piece.share * piece.du;
    weights_[Index(x, y + 1)] += 0.5 * piece.share * piece.dv;
    weights_[Index(x, y - 1)] -= 0.5 * piece.share * piece.dv;
  }

  void Filter(const Sharpener& filter, std::size_t begin, std::size_t step, int count) {
    line_.resize(static_cast<std::size_t>(count));
    for (int k = 0; k < count; ++k) {
      line_[static_cast<std::size_t>(k)] =
          weights_[begin + static_cast<std::size_t>(k) * step];
    }
    const auto at = [&](int k) {
      return k >= 0 && k < count ? line_[static_cast<std::size_t>(k)] : 0.0;
    };
    for (int k = 0; k < count; ++k) {
      weights_[begin + static_cast<std::size_t>(k) * step] =
          filter.middle * at(k) + filter.inner * (at(k - 1) + at(k + 1)) +
          filter.outer * (at(k - 2) + at(k + 2));
    }
  }

  int left_;
  int top_;
  int width_;
  int height_;
  std::vector<double> weights_;
  std::vector<double> line_;
};

// A pixel's steps in the sample plane at the picture's centre. Pixels aren't exactly
// alike in size; they nearly are across a picture.
double StepMm(const calibrate::CameraGeometry& camera, double dx, double dy) {
  const calibrate::PixelPoint centre{0.5 * (camera.width_px - 1),
                                     0.5 * (camera.height_px - 1)};
  const PointMm a = camera.SampleFromPixel({centre.x - 0.5 * dx, centre.y - 0.5 * dy});
  const PointMm b = camera.SampleFromPixel({centre.x + 0.5 * dx, centre.y + 0.5 * dy});
  return std::hypot(b.x - a.x, b.y - a.y);
}

}  // namespace

CellWeights::CellWeights(const CellLattice& lattice,
                         const calibrate::CameraGeometry& camera,
                         double spot_sigma_mm,
                         int thread_count,
                         const PlaceOnLattice& place)
    : lattice_(lattice) {
  const std::vector<std::vector<PixelPiece>> rows =
      CutPixels(lattice, camera, place, thread_count);
  const auto cells = static_cast<std::size_t>(lattice.CellCount());
  // Pieces by cell (counting sort: within a cell they keep the order of the pixels).
  std::vector<std::size_t> first(cells + 1, 0);
  for (const auto& row : rows) {
    for (const PixelPiece& piece : row) {
      ++first[static_cast<std::size_t>(piece.cell) + 1];
    }
  }
  for (std::size_t cell = 0; cell < cells; ++cell) {
    first[cell + 1] += first[cell];
  }
  std::vector<const PixelPiece*> pieces(first.back());
  std::vector<std::size_t> next(first.begin(), first.end() - 1);
  for (const auto& row : rows) {
    for (const PixelPiece& piece : row) {
      pieces[next[static_cast<std::size_t>(piece.cell)]++] = &piece;
    }
  }

  const auto variance_px2 = [&](double dx, double dy) {
    return std::pow(spot_sigma_mm / StepMm(camera, dx, dy), 2);
  };
  const Sharpener along_x(variance_px2(1, 0));
  const Sharpener along_y(variance_px2(0, 1));
  boxes_.resize(cells);
  // Rows begin where a whole number of vectors still lies in the picture.
  const std::int64_t pixels = std::int64_t{camera.width_px} * camera.height_px;
  for (std::size_t cell = 0; cell < cells; ++cell) {
    double covered = 0;
    for (std::size_t n = first[cell]; n < first[cell + 1]; ++n) {
      covered += pieces[n]->share;
    }
    if (covered < kFullCover) {
      continue;
    }
    WeightBox box(&pieces[first[cell]], first[cell + 1] - first[cell]);
    box.Sharpen(along_x, along_y);
    Box& own = boxes_[cell];
    own.first_row = rows_.size();
    own.first_weight = weights_.size();
    box.ForEachRow(camera, [&](int row, int left, const std::vector<float>& weights) {
      const auto width = static_cast<int>(weights.size());
      own.row_width = (width + kLanes - 1) / kLanes * kLanes;
      const std::int64_t wanted = std::int64_t{row} * camera.width_px + left;
      const std::int64_t start =
          std::max<std::int64_t>(0, std::min(wanted, pixels - own.row_width));
      rows_.push_back(static_cast<std::uint32_t>(start));
      ++own.row_count;
      const std::size_t at = weights_.size();
      weights_.resize(at + static_cast<std::size_t>(own.row_width), 0.0F);
      for (int x = 0; x < width; ++x) {
        weights_[at + static_cast<std::size_t>(wanted - start + x)] =
            weights[static_cast<std::size_t>(x)] / static_cast<float>(covered);
      }
    });
  }
}

namespace {

struct Sums {
  float mean[kLanes] = {};
  float variance[kLanes] = {};
  float least[kLanes] = {};  // below 0: a pixel isn't usable
};

// One row of a box, whole vectors.
[[gnu::always_inline]] inline void AddRow(const float* __restrict weight,
                                          const float* __restrict rate,
                                          const float* __restrict variance,
                                          int width,
                                          Sums& sums) {
  for (int x = 0; x < width; x += kLanes) {
    for (int lane = 0; lane < kLanes; ++lane) {
      const float w = weight[x + lane];
      const float share = w * w * variance[x + lane];
      sums.mean[lane] += w * rate[x + lane];
      sums.variance[lane] += share;
      sums.least[lane] = std::min(sums.least[lane], share);
    }
  }
}

__attribute__((target_clones("avx512f", "avx2", "default"))) void SumBox(
    const std::uint32_t* __restrict rows,
    const float* __restrict weights,
    std::pair<int, int> count_width,
    const RateFrame& frame,
    float* __restrict results) {
  Sums sums;
  const auto [count, width] = count_width;
  for (int row = 0; row < count; ++row) {
    AddRow(weights + static_cast<std::ptrdiff_t>(row) * width,
           frame.rate.data() + rows[row],
           frame.variance.data() + rows[row],
           width,
           sums);
  }
  float mean = 0;
  float variance = 0;
  float least = 0;
  for (int lane = 0; lane < kLanes; ++lane) {
    mean += sums.mean[lane];
    variance += sums.variance[lane];
    least = std::min(least, sums.least[lane]);
  }
  results[0] = least < 0 ? 0.0F : mean;
  results[1] = least < 0 ? -1.0F : variance;
}

}  // namespace

void CellWeights::Means(const RateFrame& frame,
                        std::int64_t first,
                        std::span<float> means,
                        std::span<float> variances) const {
  for (std::size_t k = 0; k < means.size(); ++k) {
    const Box& box = boxes_[static_cast<std::size_t>(first) + k];
    float results[2] = {0.0F, -1.0F};
    if (box.row_count > 0) {
      SumBox(&rows_[box.first_row],
             &weights_[box.first_weight],
             {box.row_count, box.row_width},
             frame,
             results);
    }
    means[k] = results[0];
    variances[k] = results[1];
  }
}

CellWeights::Value CellWeights::Mean(const RateFrame& frame, std::int64_t cell) const {
  float mean = 0;
  float variance = 0;
  Means(frame, cell, {&mean, 1}, {&variance, 1});
  return {static_cast<double>(mean),
          static_cast<double>(std::max(0.0F, variance)),
          variance >= 0};
}

std::size_t CellWeights::MemoryBytes() const {
  return boxes_.size() * sizeof(Box) + rows_.size() * sizeof(rows_[0]) +
         weights_.size() * sizeof(float);
}

}  // namespace nacre::reconstruct::internal
