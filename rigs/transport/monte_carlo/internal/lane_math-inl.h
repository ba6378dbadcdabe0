// Included once for each instruction set, by packet_kernel.cc alone. Products and sums
// are kept apart (no fused multiply-add), so that all instruction sets give the same
// bits.
#if defined(NACRE_MONTE_CARLO_LANE_MATH_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef NACRE_MONTE_CARLO_LANE_MATH_INL_H_
#undef NACRE_MONTE_CARLO_LANE_MATH_INL_H_
#else
#define NACRE_MONTE_CARLO_LANE_MATH_INL_H_
#endif

#include "rigs/transport/monte_carlo/threefry.h"

#include <array>
#include <cstdint>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace nacre::rigs::monte_carlo::internal {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, 16>;
using Words32 = hn::RebindToUnsigned<Floats>;
using Ints = hn::RebindToSigned<Floats>;
using F = hn::Vec<Floats>;
using U = hn::Vec<Words32>;
using I = hn::Vec<Ints>;
using Mask = hn::Mask<Floats>;

inline HWY_ATTR F Set(float value) {
  return hn::Set(Floats(), value);
}

inline HWY_ATTR F Square(F x) {
  return hn::Mul(x, x);
}

template <int kLeft>
HWY_ATTR U RotateLeft(U x) {
  return hn::RotateRight<32 - kLeft>(x);
}

struct FourWords {
  U a, b, c, d;
};

template <int kLeft1, int kLeft2>
HWY_ATTR void MixPairs(U& a, U& b, U& c, U& d) {
  a = hn::Add(a, b);
  b = hn::Xor(RotateLeft<kLeft1>(b), a);
  c = hn::Add(c, d);
  d = hn::Xor(RotateLeft<kLeft2>(d), c);
}

template <std::size_t kRound>
HWY_ATTR void Mix(FourWords& x) {
  constexpr std::array<int, 2> kTurns = kThreefryRotations[kRound % 8];
  if constexpr (kRound % 2 == 0) {
    MixPairs<kTurns[0], kTurns[1]>(x.a, x.b, x.c, x.d);
  } else {
    MixPairs<kTurns[0], kTurns[1]>(x.a, x.d, x.c, x.b);
  }
}

template <std::size_t kFirst>
HWY_ATTR void FourRounds(FourWords& x, const std::array<std::uint32_t, 5>& k) {
  Mix<kFirst>(x);
  Mix<kFirst + 1>(x);
  Mix<kFirst + 2>(x);
  Mix<kFirst + 3>(x);
  constexpr std::uint32_t kStep = kFirst / 4 + 1;
  const Words32 du;
  x.a = hn::Add(x.a, hn::Set(du, k[kStep % 5]));
  x.b = hn::Add(x.b, hn::Set(du, k[(kStep + 1) % 5]));
  x.c = hn::Add(x.c, hn::Set(du, k[(kStep + 2) % 5]));
  x.d = hn::Add(x.d, hn::Set(du, k[(kStep + 3) % 5] + kStep));
}

// Threefry<12>({photon, photon_high, step, 0}, key) in every lane; k is the key and its
// parity word, which must have k[2] = k[3] = 0.
inline HWY_ATTR FourWords Draw(U photon,
                               std::uint32_t photon_high,
                               U step,
                               const std::array<std::uint32_t, 5>& k) {
  const Words32 du;
  FourWords x{hn::Add(photon, hn::Set(du, k[0])),
              hn::Set(du, photon_high + k[1]),
              step,
              hn::Zero(du)};
  FourRounds<0>(x, k);
  FourRounds<4>(x, k);
  FourRounds<8>(x, k);
  return x;
}

// In (0, 1]; 31 bits where a float has room for them.
inline HWY_ATTR F UnitPositive(U word) {
  const F whole = hn::ConvertTo(Floats(), hn::BitCast(Ints(), hn::ShiftRight<1>(word)));
  return hn::Mul(hn::Add(whole, Set(0.5F)), Set(0x1p-31F));
}

// In [0, 1), 24 bits.
inline HWY_ATTR F UnitBelowOne(U word) {
  const F whole = hn::ConvertTo(Floats(), hn::BitCast(Ints(), hn::ShiftRight<8>(word)));
  return hn::Mul(whole, Set(0x1p-24F));
}

// In [−1, 1].
inline HWY_ATTR F Symmetric(U word) {
  return hn::Mul(hn::ConvertTo(Floats(), hn::BitCast(Ints(), word)), Set(0x1p-31F));
}

// −ln u for u in (0, 1], to 1e-7. The mantissa m is brought to [√½, √2), and
// ln m = f − f²/2 + f³ p(f), f = m − 1, with a least-maximum polynomial p.
inline HWY_ATTR F MinusLog(F u) {
  const Words32 du;
  const Ints di;
  const U root_half = hn::Set(du, 0x3F3504F3U);
  const U offset = hn::Sub(hn::BitCast(du, u), root_half);
  const F exponent =
      hn::ConvertTo(Floats(), hn::ShiftRight<23>(hn::BitCast(di, offset)));
  const F m = hn::BitCast(
      Floats(), hn::Add(hn::And(offset, hn::Set(du, 0x007FFFFFU)), root_half));
  const F f = hn::Sub(m, Set(1.0F));
  const F f2 = Square(f);
  // Estrin's order: short chains.
  const F p01 = hn::Add(hn::Mul(Set(-0.24980572F), f), Set(0.33334691F));
  const F p23 = hn::Add(hn::Mul(Set(-0.17166941F), f), Set(0.19910244F));
  const F p45 = hn::Add(hn::Mul(Set(-0.10224003F), f), Set(0.16141125F));
  const F p = hn::Add(p01, hn::Mul(f2, hn::Add(p23, hn::Mul(f2, p45))));
  const F tail = hn::Sub(hn::Mul(hn::Mul(f2, f), p), hn::Mul(Set(0.5F), f2));
  const F log_m = hn::Add(f, tail);
  const F minus = hn::Sub(hn::Mul(exponent, Set(-0.693147181F)), log_m);
  return hn::Max(minus, hn::Zero(Floats()));  // rounding could give −1e-8 at u ≈ 1
}

// A point on the unit circle, to 1e-7: an angle in ±π/4 from the lower 30 bits, then an
// exchange and a half turn from the upper two.
inline HWY_ATTR void OnCircle(U word, F& cosine, F& sine) {
  const Words32 du;
  const Ints di;
  const F a = hn::Mul(hn::ConvertTo(Floats(), hn::BitCast(di, hn::ShiftLeft<2>(word))),
                      Set(0.785398163F * 0x1p-31F));
  const F t = Square(a);
  const F s3 = hn::Add(hn::Mul(Set(-0.00019495632F), t), Set(0.0083319786F));
  const F s =
      hn::Add(a, hn::Mul(hn::Mul(a, t), hn::Add(hn::Mul(s3, t), Set(-0.16666651F))));
  const F c4 = hn::Add(hn::Mul(Set(-0.00136524463F), t), Set(0.0416612784F));
  const F c = hn::Add(Set(1.0F), hn::Mul(t, hn::Add(hn::Mul(c4, t), Set(-0.5F))));
  const Mask swap =
      hn::MaskFromVec(hn::BitCast(Floats(), hn::ShiftRight<31>(hn::BitCast(di, word))));
  const F half_turn =
      hn::BitCast(Floats(), hn::And(hn::ShiftLeft<1>(word), hn::Set(du, 0x80000000U)));
  cosine = hn::Xor(hn::IfThenElse(swap, s, c), half_turn);
  sine = hn::Xor(hn::IfThenElse(swap, c, s), half_turn);
}

// Unpolarised Fresnel reflectance; ratio = index behind over index here. Exactly 0 for
// ratio = 1.
inline HWY_ATTR F Fresnel(F cosine, F ratio) {
  const F one = Set(1.0F);
  const F ratio2 = Square(ratio);
  // ratio² cos²θ_t = ratio² − sin²θ, in the order that is exact for ratio = 1.
  const F behind2 = hn::Add(hn::Sub(ratio2, one), Square(cosine));
  const F behind = hn::Sqrt(hn::Max(behind2, hn::Zero(Floats())));  // ratio · cosθ_t
  const F across = hn::Mul(ratio2, cosine);
  const F s_num = hn::Sub(cosine, behind);
  const F s_den = hn::Add(cosine, behind);
  const F p_num = hn::Sub(across, behind);
  const F p_den = hn::Add(across, behind);
  const F sum = hn::Add(Square(hn::Mul(s_num, p_den)), Square(hn::Mul(p_num, s_den)));
  const F reflectance = hn::Div(hn::Mul(Set(0.5F), sum), Square(hn::Mul(s_den, p_den)));
  return hn::IfThenElse(hn::Le(behind2, hn::Zero(Floats())), one, reflectance);
}

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace nacre::rigs::monte_carlo::internal
HWY_AFTER_NAMESPACE();
#endif
