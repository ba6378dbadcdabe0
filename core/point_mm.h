#pragma once

namespace nacre {

/// A position or an offset in the sample plane: millimetres, origin at the sample's
/// centre, +x right, +y up.
struct PointMm {
  double x = 0;
  double y = 0;
  friend bool operator==(const PointMm&, const PointMm&) = default;
};

}  // namespace nacre
