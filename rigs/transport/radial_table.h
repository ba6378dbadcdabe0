#pragma once

#include "rigs/pattern.h"

#include <cstddef>
#include <functional>
#include <vector>

namespace nacre::rigs {

/// A positive function of distance r and a fraction f in [0, 1], tabulated for speed:
/// log₂ of it, bilinear over nodes that are dense where it bends.
///   - along r: nodes are the floats 1 + r²/r₀² with the low bits cut off, so that the
///     bits of that float are the index, without a logarithm;
///   - along f: w = √(c + f) (scaled to [0, 1]), since diffusion depends on √σ_a.
class RadialTable {
 public:
  struct Layout {
    double inner_mm = 1;             ///< r₀: below it the function is nearly constant
    double outer_mm = 1000;          ///< beyond it the value there is returned
    double fraction_offset = 1;      ///< c ≥ 0
    bool fraction_reversed = false;  ///< put 1 − f in place of f
    int fraction_rows = 65;          ///< 2 for a function that doesn't depend on f
  };
  /// Tabulates value(f, r) > 0.
  RadialTable(const Layout& layout,
              const std::function<double(double fraction, double r_mm)>& value,
              int thread_count);

  /// out[k] += scale · value(fraction[k], |points[k] − centre|).
  void Add(PointMm centre,
           double scale,
           const PointColumns& points,
           const float* fraction,
           float* out) const;

  double Value(double r_mm, double fraction) const;

  /// The smallest node distance beyond which ∫ value 2πr dr < loss for every fraction.
  double Reach(double loss) const;

 private:
  double NodeDistance(std::size_t node) const;
  double RowFraction(int row) const;

  Layout layout_;
  float inverse_inner2_ = 1;
  float offset_ = 1;
  float offset_root_ = 1;
  float row_scale_ = 1;
  int nodes_ = 0;
  std::vector<float> log2_;  // fraction_rows × nodes
};

}  // namespace nacre::rigs
