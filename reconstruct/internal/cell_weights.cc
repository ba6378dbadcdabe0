#include "reconstruct/internal/cell_weights.h"

#include <algorithm>
#include <cmath>

namespace nacre::reconstruct::internal {
namespace {

// Pixel edges are drawn straight in the sample plane; what distortion bends them by is
// far below this share of a cell.
constexpr double kFullCover = 0.999;

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

  // Calls visit(pixel, weight); what lies beyond the picture's rim is its rim.
  template <class Visit>
  void ForEach(const calibrate::CameraGeometry& camera, Visit&& visit) const {
    constexpr double kNothing = 1e-9;
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) {
        const double weight = weights_[Index(x, y)];
        if (std::abs(weight) > kNothing) {
          visit(std::clamp(top_ + y, 0, camera.height_px - 1) * camera.width_px +
                    std::clamp(left_ + x, 0, camera.width_px - 1),
                weight);
        }
      }
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
                         int thread_count)
    : lattice_(lattice) {
  const std::vector<std::vector<PixelPiece>> rows =
      CutPixels(lattice, camera, thread_count);
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
  covered_.resize(cells);
  begin_.assign(1, 0);
  for (std::size_t cell = 0; cell < cells; ++cell) {
    double covered = 0;
    for (std::size_t n = first[cell]; n < first[cell + 1]; ++n) {
      covered += pieces[n]->share;
    }
    covered_[cell] = covered >= kFullCover ? 1 : 0;
    if (covered_[cell] != 0) {
      WeightBox box(&pieces[first[cell]], first[cell + 1] - first[cell]);
      box.Sharpen(along_x, along_y);
      box.ForEach(camera, [&](int pixel, double weight) {
        shares_.push_back(
            {static_cast<std::uint32_t>(pixel), static_cast<float>(weight / covered)});
      });
    }
    begin_.push_back(shares_.size());
  }
}

CellWeights::Value CellWeights::Mean(const RateFrame& frame, std::int64_t cell) const {
  const auto c = static_cast<std::size_t>(cell);
  Value value;
  value.valid = covered_[c] != 0;
  for (std::size_t n = begin_[c]; n < begin_[c + 1]; ++n) {
    const auto weight = static_cast<double>(shares_[n].weight);
    const auto variance = static_cast<double>(frame.variance[shares_[n].pixel]);
    value.valid = value.valid && variance >= 0;
    value.mean += weight * static_cast<double>(frame.rate[shares_[n].pixel]);
    value.variance += weight * weight * variance;
  }
  return value.valid ? value : Value{};
}

std::size_t CellWeights::MemoryBytes() const {
  return begin_.size() * sizeof(std::size_t) + shares_.size() * sizeof(Share) +
         covered_.size();
}

}  // namespace nacre::reconstruct::internal
