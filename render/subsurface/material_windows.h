#pragma once

#include "render/subsurface/color_lanes.h"
#include "render/subsurface/window_profile.h"
#include "render/subsurface/window_source.h"
#include "render/vec.h"

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

namespace nacre::render {

/// R'_d(x_i, d) of a measured material between its grid points and cells, for lookup.
///
/// A material says where light goes that enters at a grid point, as means over cells.
/// Light that enters beside the point leaves around where it entered, by the window's
/// own profile P (WindowProfile), but through the same cells: R_d = P(|x_o − x_i|) q,
/// where q, the ratio of what was measured to P, is known a cell. Within a cell q
/// changes linearly, by slopes that are limited [vanLeer79], so that a border between
/// materials stays as sharp as the cells are; of a window whose light enters at the
/// grid point itself every cell's mean is what was measured. The albedo changes in the
/// same way from point to point.
///
/// A window is evaluated when it is first asked for, and kept as long as memory lasts;
/// values don't depend on what is kept. Safe to use from many threads.
class MaterialWindows {
 public:
  /// BadData unless the material has one channel (used for all three colours) or three.
  /// Of `colours` that are false nothing is asked; there, R_d is 0.
  MaterialWindows(std::shared_ptr<const WindowSource> source,
                  double cache_mb,
                  const std::array<bool, 3>& colours = {true, true, true});
  ~MaterialWindows();
  MaterialWindows(const MaterialWindows&) = delete;
  MaterialWindows& operator=(const MaterialWindows&) = delete;

  /// Where light enters.
  struct Entry {
    int window = 0;    ///< of the nearest grid point
    Vec2 beside;       ///< from that point, in pitches to the right and downwards
    ColorLanes scale;  ///< of the window, for what the albedo is between the points
  };
  /// Of texture coordinates, which repeat; half a pitch from the border of a tile, and
  /// beyond, what counts is the last point.
  Entry EntryAt(Vec2 uv) const;

  /// Which light may be taken together before it is given an entry: −1 for light that
  /// enters well within one material, else the grid point. Next to a border, where the
  /// albedo changes by more than a few percent, points are kept apart.
  int PartAt(Vec2 uv) const;

  /// R_d in mm⁻², to be scaled by the entry's `scale`. `squared`: |x_o − x_i|²;
  /// `column`, `row`: of x_o from the window's grid point; all in pitches.
  ColorLanes At(int window, float squared, float column, float row) const;

  /// Gets what At will read on its way from memory.
  void Prefetch(int window, float squared, float column, float row) const;

  /// Σ_d R_d · pitch² of a window, by the material's own albedo map.
  Color Albedo(int window) const;

  float pitch_mm() const { return static_cast<float>(source_->pitch_mm); }
  /// Beyond this many pitches from the grid point, to any side, R_d is zero.
  float radius() const { return radius_; }
  std::int64_t evaluated_count() const { return evaluated_count_.load(); }
  std::int64_t window_count() const { return std::ssize(kept_); }
  const WindowSource& source() const { return *source_; }
  const std::shared_ptr<const WindowSource>& source_ptr() const { return source_; }

 private:
  /// q within a cell: value + column · x + row · y, x and y from the cell's middle.
  struct Cell {
    ColorLanes value;
    ColorLanes column;
    ColorLanes row;
  };
  /// What is known of a cell and its neighbours to both sides, of which there may be
  /// none.
  struct Ratios {
    ColorLanes here;
    const ColorLanes* left = nullptr;
    const ColorLanes* right = nullptr;
    const ColorLanes* above = nullptr;
    const ColorLanes* below = nullptr;
  };

  const WindowProfile& ProfileOf(int window) const;
  std::vector<ColorLanes> Means(int window) const;
  ColorLanes Mean(int window, int u, int v) const;
  Cell MakeCell(const Ratios& q, const WindowProfile::Moments& moments) const;
  std::unique_ptr<Cell[]> Evaluate(int window) const;
  Cell EvaluateCell(int window, int u, int v) const;
  const Cell* Find(int window) const;

  std::shared_ptr<const WindowSource> source_;
  std::array<int, 3> channel_of_colour_{};  ///< −1: not wanted
  double internal_reflectance_ = 0;
  float radius_ = 0;
  std::int64_t kept_most_ = 0;
  mutable std::atomic<std::int64_t> evaluated_count_ = 0;
  mutable std::vector<std::atomic<const Cell*>> kept_;  ///< core² cells of a window
  mutable std::vector<std::atomic<const WindowProfile*>> profiles_;
};

}  // namespace nacre::render
