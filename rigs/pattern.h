#pragma once

#include "acquire/scan_map.h"

#include <cstddef>
#include <memory>
#include <string>

namespace nacre::rigs {

using nacre::PointMm;

class MixtureMap;

/// How two media share the sample plane; the same at every depth, laterally infinite.
enum class PatternType {
  kHomogeneous,  ///< the first medium everywhere
  kChessboard,   ///< the cell whose lower left corner is the origin is the first medium
  kStripes,      ///< along y; the first medium for x in [0, cell_mm)
  kMixture,      ///< mixed continuously, as a MixtureMap says
};

/// The name a phantom file gives it.
const char* Name(PatternType type);

/// Points of the sample plane as two columns, for loops that the compiler vectorises.
struct PointColumns {
  const float* x_mm = nullptr;
  const float* y_mm = nullptr;
  std::size_t count = 0;
};

struct Pattern {
  PatternType type = PatternType::kHomogeneous;
  double cell_mm = 0;  ///< side of a square, width of a stripe
  std::shared_ptr<const MixtureMap> mixture = nullptr;  ///< of kMixture, never null

  /// How many media the pattern is made of.
  int MediumCount() const { return type == PatternType::kHomogeneous ? 1 : 2; }

  /// Whether every point is in one medium or the other.
  bool IsPure() const { return type != PatternType::kMixture; }

  /// 0 or 1: the medium at a point, of a mixture the one there is more of. A cell owns
  /// its left and lower edges.
  int MediumAt(PointMm point) const;

  /// fraction[k] = the part of the straight segment from `from` to point k that lies in
  /// the second medium: exact up to rounding (of mixtures, as MixtureMap says), and the
  /// same with the ends exchanged.
  void SecondMediumFraction(PointMm from,
                            const PointColumns& to,
                            float* fraction) const;
  double SecondMediumFraction(PointMm from, PointMm to) const;
};

}  // namespace nacre::rigs
