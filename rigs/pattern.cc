#include "rigs/pattern.h"

#include "core/error.h"
#include "core/simd_clones.h"
#include "rigs/pattern_mixture.h"

#include <algorithm>
#include <cmath>

namespace nacre::rigs {
namespace {

// The integral from 0 to u of the square wave that is +1 on [0, 1), −1 on [1, 2) and
// has period 2: a triangle wave.
[[gnu::always_inline]] inline float Triangle(float u) {
  const float phase = u - 2.0F * std::floor(0.5F * u);
  return 1.0F - std::abs(phase - 1.0F);
}

// The square wave itself.
[[gnu::always_inline]] inline float Square(float u) {
  const float half = 0.5F * std::floor(u);
  return half == std::floor(half) ? 1.0F : -1.0F;
}

// Mean of the square wave between u and u + du.
[[gnu::always_inline]] inline float MeanSquare(float u, float du) {
  constexpr float kTooShort = 1e-4F;  // a difference quotient is all rounding there
  const float quotient = (Triangle(u + du) - Triangle(u)) / du;
  return std::abs(du) > kTooShort ? quotient : Square(u + 0.5F * du);
}

[[gnu::always_inline]] inline float FractionFromMean(float mean) {
  return std::min(1.0F, std::max(0.0F, 0.5F - 0.5F * mean));
}

struct Segment {
  float from_x;  // in cells
  float from_y;
  float per_mm;  // cells a millimetre
};

NACRE_SIMD_CLONES void StripeFractions(const Segment& s,
                                       const PointColumns& to,
                                       float* __restrict fraction) {
  const float* __restrict x = to.x_mm;
  for (std::size_t k = 0; k < to.count; ++k) {
    fraction[k] = FractionFromMean(MeanSquare(s.from_x, x[k] * s.per_mm - s.from_x));
  }
}

// The chessboard is the product of two square waves, +1 in the first medium. Along the
// axis of the smaller extent the segment crosses few lines: between two of them that
// wave is constant, and the other one integrates to differences of its triangle wave.
// This has no case distinctions, so a segment through a corner is as good as any.
constexpr std::size_t kPiece = 64;

// What is known of each segment of a piece while its lines are walked through.
struct Walk {
  float major[kPiece];
  float d_major[kPiece];
  float reach[kPiece];      // |extent| along the minor axis
  float next_line[kPiece];  // distance to it along the minor axis, > 0
  float slope[kPiece];      // major per unit of the minor axis
  float sign[kPiece];
  float passed[kPiece];
  float sum[kPiece];
};

NACRE_SIMD_CLONES void StartWalk(const Segment& s, const PointColumns& to, Walk& walk) {
  const float* __restrict x = to.x_mm;
  const float* __restrict y = to.y_mm;
  for (std::size_t k = 0; k < to.count; ++k) {
    const float dx = x[k] * s.per_mm - s.from_x;
    const float dy = y[k] * s.per_mm - s.from_y;
    const bool x_is_major = std::abs(dx) >= std::abs(dy);
    const float major = x_is_major ? s.from_x : s.from_y;
    const float minor = x_is_major ? s.from_y : s.from_x;
    const float d_major = x_is_major ? dx : dy;
    const float d_minor = x_is_major ? dy : dx;
    const bool up = d_minor >= 0.0F;
    // A cell owns its lower edge: who leaves an edge downwards is in the cell below.
    const float cell = up ? std::floor(minor) : std::ceil(minor) - 1.0F;
    const float reach = std::abs(d_minor);
    walk.major[k] = major;
    walk.d_major[k] = d_major;
    walk.reach[k] = reach;
    walk.next_line[k] = up ? cell + 1.0F - minor : minor - cell;
    walk.slope[k] = d_major / (reach > 0.0F ? reach : 1.0F);
    walk.sign[k] = Square(cell);
    walk.passed[k] = Triangle(major);
    walk.sum[k] = 0.0F;
  }
}

NACRE_SIMD_CLONES void PassLine(Walk& walk, std::size_t count) {
  for (std::size_t k = 0; k < count; ++k) {
    const bool reached = walk.next_line[k] < walk.reach[k];
    const float here = Triangle(walk.major[k] + walk.next_line[k] * walk.slope[k]);
    const float part = walk.sign[k] * (here - walk.passed[k]);
    walk.sum[k] += reached ? part : 0.0F;
    walk.passed[k] = reached ? here : walk.passed[k];
    walk.sign[k] = reached ? -walk.sign[k] : walk.sign[k];
    walk.next_line[k] += 1.0F;
  }
}

NACRE_SIMD_CLONES void FinishWalk(const Segment& s,
                                  const Walk& walk,
                                  std::size_t count,
                                  float* __restrict fraction) {
  constexpr float kTooShort = 1e-4F;
  const float at_start = Square(s.from_x) * Square(s.from_y);
  for (std::size_t k = 0; k < count; ++k) {
    const float d_major = walk.d_major[k];
    const float last = Triangle(walk.major[k] + d_major) - walk.passed[k];
    const float mean = (walk.sum[k] + walk.sign[k] * last) / d_major;
    fraction[k] = FractionFromMean(std::abs(d_major) > kTooShort ? mean : at_start);
  }
}

void ChessboardFractions(const Segment& s, const PointColumns& to, float* fraction) {
  Walk walk;
  StartWalk(s, to, walk);
  float most = 0;
  for (std::size_t k = 0; k < to.count; ++k) {
    most = std::max(most, walk.reach[k]);
  }
  const int lines = static_cast<int>(std::ceil(most)) + 1;
  for (int line = 0; line < lines; ++line) {
    PassLine(walk, to.count);
  }
  FinishWalk(s, walk, to.count, fraction);
}

}  // namespace

const char* Name(PatternType type) {
  switch (type) {
    case PatternType::kHomogeneous:
      return "homogeneous";
    case PatternType::kChessboard:
      return "chessboard";
    case PatternType::kStripes:
      return "stripes";
    case PatternType::kMixture:
      return "mixture";
  }
  throw LogicError("a pattern of no type");
}

int Pattern::MediumAt(PointMm point) const {
  const auto parity = [&](double u) {
    return std::fmod(std::abs(std::floor(u / cell_mm)), 2.0) != 0 ? 1 : 0;
  };
  switch (type) {
    case PatternType::kHomogeneous:
      return 0;
    case PatternType::kChessboard:
      return parity(point.x) ^ parity(point.y);
    case PatternType::kStripes:
      return parity(point.x);
    case PatternType::kMixture:
      return mixture->At(point) >= 0.5 ? 1 : 0;
  }
  throw LogicError("a pattern of no type");
}

void Pattern::SecondMediumFraction(PointMm from,
                                   const PointColumns& to,
                                   float* fraction) const {
  if (type == PatternType::kHomogeneous) {
    std::fill_n(fraction, to.count, 0.0F);
    return;
  }
  if (type == PatternType::kMixture) {
    mixture->SegmentFractions(from, to, fraction);
    return;
  }
  const Segment segment{static_cast<float>(from.x / cell_mm),
                        static_cast<float>(from.y / cell_mm),
                        static_cast<float>(1 / cell_mm)};
  if (type == PatternType::kStripes) {
    StripeFractions(segment, to, fraction);
    return;
  }
  for (std::size_t begin = 0; begin < to.count; begin += kPiece) {
    const PointColumns piece{
        to.x_mm + begin, to.y_mm + begin, std::min(kPiece, to.count - begin)};
    ChessboardFractions(segment, piece, fraction + begin);
  }
}

double Pattern::SecondMediumFraction(PointMm from, PointMm to) const {
  const float x = static_cast<float>(to.x);
  const float y = static_cast<float>(to.y);
  float fraction = 0;
  SecondMediumFraction(from, {&x, &y, 1}, &fraction);
  return static_cast<double>(fraction);
}

}  // namespace nacre::rigs
