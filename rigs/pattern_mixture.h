#pragma once

#include "rigs/pattern.h"

#include <cstddef>
#include <vector>

namespace nacre::rigs {

/// Two media mixed continuously over the sample plane: the second one's fraction on a
/// grid of square cells, its border cells going on for ever.
class MixtureMap {
 public:
  struct Layout {
    int count_x = 0;
    int count_y = 0;
    double cell_mm = 0;
    double left_mm = 0;   ///< x of the grid's left edge
    double lower_mm = 0;  ///< y of its lower edge
  };

  /// `fraction`: row by row from the bottom (−y), each from the left. Throws LogicError
  /// for a wrong number of values and values outside [0, 1].
  MixtureMap(const Layout& layout, std::vector<float> fraction);

  const Layout& layout() const { return layout_; }
  /// As given to the constructor.
  const float* Fractions() const { return cells_.data(); }

  /// Between the cells' centres: bilinear.
  double At(PointMm point) const;

  /// Means along segments, as Pattern::SecondMediumFraction: by 24 equidistant samples,
  /// of cells grouped by 2, 4, 8, … so that they are about as far apart as wide, as far
  /// as that leaves 24 groups across the map. Exact for linear fields; the same with
  /// the ends exchanged up to rounding.
  void SegmentFractions(PointMm from, const PointColumns& to, float* fraction) const;

 private:
  struct Level {
    int count_x = 0;
    int count_y = 0;
    int begin = 0;  // of its cells in cells_
    float per_cell = 1;
  };

  Layout layout_;
  std::vector<Level> levels_;  // from the finest
  int coarsest_ = 0;           // index of the last
  std::vector<float> cells_;
};

}  // namespace nacre::rigs
