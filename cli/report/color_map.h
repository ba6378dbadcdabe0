#pragma once

#include <array>
#include <cstdint>

namespace nacre::cli::report {

using Rgb8 = std::array<std::uint8_t, 3>;

/// Dark to light for t in [0, 1]; lightness rises evenly. Clamped; NaN is the start.
Rgb8 SequentialColor(double t);

/// Blue, near white at 0, red for t in [−1, 1]. Clamped.
Rgb8 DivergingColor(double t);

}  // namespace nacre::cli::report
