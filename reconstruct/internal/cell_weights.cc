#include "reconstruct/internal/cell_weights.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace nacre::reconstruct::internal {
namespace {

// Pixel edges are drawn straight in the sample plane; what distortion bends them by is
// far below this share of a cell.
constexpr double kFullCover = 0.999;

// Coefficients of the five pixels of a cross, for one piece of its middle pixel.
class Stencil {
 public:
  Stencil(const calibrate::CameraGeometry& camera, double spot_sigma_mm)
      : width_(camera.width_px), height_(camera.height_px) {
    // Pixels aren't exactly alike in size; they are across a window.
    const auto step = [&](double dx, double dy) {
      const calibrate::PixelPoint centre{0.5 * (width_ - 1), 0.5 * (height_ - 1)};
      const calibrate::PointMm a =
          camera.SampleFromPixel({centre.x - dx, centre.y - dy});
      const calibrate::PointMm b =
          camera.SampleFromPixel({centre.x + dx, centre.y + dy});
      return std::hypot(b.x - a.x, b.y - a.y);
    };
    const double variance_mm2 = spot_sigma_mm * spot_sigma_mm;
    sharpen_x_ = 0.5 * variance_mm2 / std::pow(step(0.5, 0), 2);
    sharpen_y_ = 0.5 * variance_mm2 / std::pow(step(0, 0.5), 2);
  }

  void Add(const PixelPiece& piece, std::map<std::uint32_t, double>& weights) const {
    const double area = piece.share;
    double middle = area;
    // Slope and curvature along one axis; at the picture's rim there is no neighbour.
    const auto axis = [&](int at, int count, int stride, double offset, double blur) {
      if (at == 0 || at + 1 == count) {
        return;
      }
      const int pixel = piece.row * width_ + piece.column;
      const auto next = static_cast<std::uint32_t>(pixel + stride);
      const auto last = static_cast<std::uint32_t>(pixel - stride);
      weights[next] += area * (0.5 * offset - blur);
      weights[last] += area * (-0.5 * offset - blur);
      middle += 2 * area * blur;
    };
    axis(piece.column, width_, 1, piece.du, sharpen_x_);
    axis(piece.row, height_, width_, piece.dv, sharpen_y_);
    weights[static_cast<std::uint32_t>(piece.row * width_ + piece.column)] += middle;
  }

 private:
  int width_;
  int height_;
  double sharpen_x_;
  double sharpen_y_;
};

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

  const Stencil stencil(camera, spot_sigma_mm);
  covered_.resize(cells);
  begin_.assign(1, 0);
  for (std::size_t cell = 0; cell < cells; ++cell) {
    std::map<std::uint32_t, double> weights;
    double covered = 0;
    for (std::size_t n = first[cell]; n < first[cell + 1]; ++n) {
      stencil.Add(*pieces[n], weights);
      covered += pieces[n]->share;
    }
    covered_[cell] = covered >= kFullCover ? 1 : 0;
    constexpr double kNothing = 1e-9;
    for (const auto& [pixel, weight] : weights) {
      if (covered_[cell] != 0 && std::abs(weight) > kNothing) {
        shares_.push_back({pixel, static_cast<float>(weight / covered)});
      }
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
