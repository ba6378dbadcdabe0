#pragma once

#include "render/subsurface/color_lanes.h"
#include "render/subsurface/window_centre.h"
#include "render/subsurface/window_source.h"

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

namespace nacre::render {

/// R'_d(x_i, d) of a factored material between its grid points and cells, for lookup.
///
/// Along x_i, windows are taken half a pitch apart: at grid points and, as the mean of
/// two or four of them, in between. Along d, cells are interpolated (WindowCentre near
/// the peak, bilinearly elsewhere, to zero beyond the rim), which keeps the albedo. A
/// window is evaluated when it is first asked for, and kept as long as memory lasts;
/// values don't depend on what is kept. Safe to use from many threads.
class MaterialWindows {
 public:
  /// BadData unless the material has one channel (used for all three colours) or three.
  MaterialWindows(std::shared_ptr<const WindowSource> source, double cache_mb);
  ~MaterialWindows();
  MaterialWindows(const MaterialWindows&) = delete;
  MaterialWindows& operator=(const MaterialWindows&) = delete;

  /// The window nearest to a point with these texture coordinates, which repeat; half a
  /// pitch from the border of a tile, and beyond, windows are those of the last points.
  int WindowAt(Vec2 uv) const;

  /// R_d in mm⁻² at an offset from the window's x_i, in pitches, to the right and
  /// downwards.
  ColorLanes At(int window, float column, float row) const;

  /// Gets what At will read on its way from memory.
  void Prefetch(int window, float column, float row) const;

  /// Σ_d R_d · pitch² of a window, by the material's own albedo map.
  Color Albedo(int window) const;

  float pitch_mm() const { return static_cast<float>(source_->pitch_mm); }
  /// Beyond this many pitches, to any side, R_d is zero.
  float radius() const { return radius_; }
  std::int64_t evaluated_count() const { return evaluated_count_.load(); }
  std::int64_t window_count() const { return std::ssize(kept_); }
  const WindowSource& source() const { return *source_; }

 private:
  /// The one, two or four grid points that a window is the mean of.
  struct Points {
    std::array<std::array<int, 2>, 4> ij;
    std::size_t count = 0;
  };

  Points PointsOf(int window) const;
  ColorLanes Cell(const Points& points, int u, int v) const;
  std::unique_ptr<ColorLanes[]> Evaluate(const Points& points) const;
  const ColorLanes* Find(int window) const;
  std::size_t CellCount() const {
    const auto side = static_cast<std::size_t>(source_->core + 2);
    return side * side;
  }

  std::shared_ptr<const WindowSource> source_;
  std::array<int, 3> channel_of_colour_{};
  int columns_ = 0;  ///< windows along x
  int rows_ = 0;
  float radius_ = 0;
  std::int64_t kept_most_ = 0;
  mutable std::atomic<std::int64_t> evaluated_count_ = 0;
  /// Of each window kept: (core + 2)² cells with a border of zeros, then the nodes of
  /// its WindowCentre.
  mutable std::vector<std::atomic<const ColorLanes*>> kept_;
};

}  // namespace nacre::render
