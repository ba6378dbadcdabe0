#pragma once

#include "calibrate/calibration.h"
#include "reconstruct/internal/pixel_cells.h"
#include "reconstruct/internal/sharpener.h"

#include <algorithm>
#include <cstddef>
#include <vector>

namespace nacre::reconstruct::internal {

//// The weights of the pixels around one cell, dense: a filter of the picture is the
/// same filter of the weights, since it is symmetric.
class WeightBox {
 public:
  // Room for slopes and the filter around the pixels of the pieces.
  static constexpr int kMargin = 1 + Sharpener::kReach;

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

  void Sharpen(const Sharpener& sharpener) {
    sharpener.Apply(weights_, width_, height_);
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
      visit(to, left, row);  // which may change it
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
    // And the curvature.
    const double uu = 0.5 * piece.share * piece.duu;
    const double vv = 0.5 * piece.share * piece.dvv;
    const double uv = 0.25 * piece.share * piece.duv;
    weights_[Index(x, y)] -= 2 * (uu + vv);
    weights_[Index(x + 1, y)] += uu;
    weights_[Index(x - 1, y)] += uu;
    weights_[Index(x, y + 1)] += vv;
    weights_[Index(x, y - 1)] += vv;
    weights_[Index(x + 1, y + 1)] += uv;
    weights_[Index(x - 1, y - 1)] += uv;
    weights_[Index(x + 1, y - 1)] -= uv;
    weights_[Index(x - 1, y + 1)] -= uv;
  }

  int left_;
  int top_;
  int width_;
  int height_;
  std::vector<double> weights_;
};

}  // namespace nacre::reconstruct::internal
