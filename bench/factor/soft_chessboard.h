#pragma once

#include "reconstruct/rd_dataset.h"

namespace nacre::bench {

/// exp(−σ r) z / r³, σ the mean over both ends and the middle of the way, of two media
/// in a chessboard with soft borders and fine texture; noise of 1e-5 of the peak.
/// Channels differ by their σ.
reconstruct::RdDataset MakeSoftChessboard(int points_x,
                                          int points_y,
                                          int core,
                                          int channels);

}  // namespace nacre::bench
