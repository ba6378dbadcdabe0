#pragma once

#include "reconstruct/internal/separation.h"
#include "reconstruct/rd_dataset.h"

#include <cstdint>

namespace nacre::reconstruct::internal {

/// What averaging did to slices.
struct SymmetrizeChange {
  double changed = 0;  ///< Σ |change|
  double all = 0;      ///< Σ R_d
  double worst_total = 0;
  void Add(const SymmetrizeChange& other);
  double Share() const { return all > 0 ? changed / all : 0; }
};

/// Makes R_d(x_i, x_o) of slice s the mean of itself and R_d(x_o, x_i), each weighted
/// by the inverse of its variance, where x_o is a grid point and both were measured.
SymmetrizeChange Symmetrize(const RdHeader& header,
                            const Separation& separation,
                            std::int64_t s,
                            RdSlice& slice);

}  // namespace nacre::reconstruct::internal
