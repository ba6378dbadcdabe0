#pragma once

#include "factor/material.h"
#include "reconstruct/rd_dataset.h"

#include <cstdint>

namespace nacre::testing {

/// What MakeChessboard varies.
struct SyntheticOptions {
  int points_x = 32;
  int points_y = 32;
  int core = 15;
  int channels = 3;
  double noise = 0;  ///< standard deviation over the peak
  double scale = 1;  ///< multiplies every value
  std::uint64_t seed = 1;
};

/// R_d of two marble-like media in a chessboard with soft borders: a source below the
/// surface, exp(−σ r) z / r³, whose σ is the average along the way from x_i to x_o: a
/// dataset like those of a rig, in closed form.
reconstruct::RdDataset MakeChessboard(const SyntheticOptions& options);

/// A dataset whose slices are all `value`, all valid.
reconstruct::RdDataset MakeConstant(int points_x, int points_y, int core, float value);

/// A random material, valid in every field.
factor::Material MakeMaterial(std::uint64_t seed);

}  // namespace nacre::testing
