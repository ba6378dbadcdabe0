#pragma once

#include "calibrate/corrections.h"

#include <vector>

namespace nacre::calibrate::internal {

/// The mean of a square of pixels, at (u, v) of SmoothField.
struct Block {
  double u = 0;
  double v = 0;
  double mean = 0;
  int count = 0;  ///< of pixels that count
};

/// Means over blocks of side × side pixels; those of `excluded`, if it isn't empty,
/// don't count. Blocks with no pixel are left out.
std::vector<Block> BlockMeans(const std::vector<float>& picture,
                              int width,
                              int side,
                              const std::vector<bool>& excluded);

/// Least squares, each block with the weight of its pixels. `sigma` of the result is
/// that of a fitted value, from the residuals.
SmoothField FitSmoothField(const std::vector<Block>& blocks, int degree);

/// Root mean square residual of the blocks.
double ResidualRms(const std::vector<Block>& blocks, const SmoothField& field);

}  // namespace nacre::calibrate::internal
