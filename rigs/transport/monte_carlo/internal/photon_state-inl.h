// The photons that fill a vector's lanes, and how a collision turns them. Included once
// for each instruction set, by packet_kernel.cc alone.
#if defined(NACRE_MONTE_CARLO_PHOTON_STATE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef NACRE_MONTE_CARLO_PHOTON_STATE_INL_H_
#undef NACRE_MONTE_CARLO_PHOTON_STATE_INL_H_
#else
#define NACRE_MONTE_CARLO_PHOTON_STATE_INL_H_
#endif

#include "rigs/transport/monte_carlo/internal/lane_math-inl.h"
#include "rigs/transport/monte_carlo/internal/packet.h"

#include <array>
#include <bit>
#include <cstdint>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace nacre::rigs::monte_carlo::internal {
namespace HWY_NAMESPACE {

struct State {
  F x, y, z;
  F ux, uy, uz;
  U photon, step, fate, scattered, active;
  I part;  // medium or layer
};

inline HWY_ATTR State LoadState(const Roster& roster) {
  const Floats d;
  const Words32 du;
  return {hn::Load(d, roster.x.data()),
          hn::Load(d, roster.y.data()),
          hn::Load(d, roster.z.data()),
          hn::Load(d, roster.ux.data()),
          hn::Load(d, roster.uy.data()),
          hn::Load(d, roster.uz.data()),
          hn::Load(du, roster.photon.data()),
          hn::Load(du, roster.step.data()),
          hn::Load(du, roster.fate.data()),
          hn::Load(du, roster.scattered.data()),
          hn::Load(du, roster.active.data()),
          hn::Load(Ints(), roster.part.data())};
}

// Hands the photons that ended to the roster and takes what it puts in their lanes.
inline HWY_ATTR void ReplaceEnded(Mask ended, Roster& roster, State& s) {
  const Floats d;
  const Words32 du;
  hn::Store(s.x, d, roster.x.data());
  hn::Store(s.y, d, roster.y.data());
  hn::Store(s.z, d, roster.z.data());
  hn::Store(s.ux, d, roster.ux.data());
  hn::Store(s.uy, d, roster.uy.data());
  hn::Store(s.uz, d, roster.uz.data());
  hn::Store(s.photon, du, roster.photon.data());
  hn::Store(s.step, du, roster.step.data());
  hn::Store(s.fate, du, roster.fate.data());
  hn::Store(s.scattered, du, roster.scattered.data());
  hn::Store(s.part, Ints(), roster.part.data());
  std::array<std::uint8_t, 8> bytes{};  // StoreMaskBits may write as many
  hn::StoreMaskBits(d, ended, bytes.data());
  unsigned bits = bytes[0] | (static_cast<unsigned>(bytes[1]) << 8);
  while (bits != 0) {
    roster.Replace(static_cast<std::size_t>(std::countr_zero(bits)));
    bits &= bits - 1;
  }
  s = LoadState(roster);
}

// Henyey & Greenstein's cosine, solved for without a division by g, so that it holds
// for g = 0: with s = 2u − 1,
//   μ = (2s + g (s² + 3) + 2g² s + g³ (s² − 1)) / (2 (1 + g s)²).
inline HWY_ATTR F HenyeyGreensteinCosine(F s, F g) {
  const F s2 = Square(s);
  const F g2 = Square(g);
  const F even = hn::Add(hn::Add(s2, Set(3.0F)), hn::Mul(g2, hn::Sub(s2, Set(1.0F))));
  const F odd = hn::Mul(hn::Add(s, s), hn::Add(Set(1.0F), g2));
  const F one_plus = hn::Add(Set(1.0F), hn::Mul(g, s));
  const F denominator = Square(one_plus);
  const F mu =
      hn::Div(hn::Add(odd, hn::Mul(g, even)), hn::Add(denominator, denominator));
  return hn::Min(hn::Max(mu, Set(-1.0F)), Set(1.0F));
}

struct Direction {
  F x, y, z;
};

inline HWY_ATTR F SineOf(F cosine) {
  const F one = Set(1.0F);
  return hn::Sqrt(hn::Mul(hn::Sub(one, cosine), hn::Add(one, cosine)));
}

// The direction at `cosine` from (ux, uy, uz), with the orthonormal basis of Duff et
// al. 2017, and rescaled so that rounding doesn't accumulate.
inline HWY_ATTR Direction Turn(const State& s, F cosine, F cos_azimuth, F sin_azimuth) {
  const F one = Set(1.0F);
  const F sine = SineOf(cosine);
  const F p = hn::Mul(sine, cos_azimuth);
  const F q = hn::Mul(sine, sin_azimuth);
  const F sign = hn::CopySignToAbs(one, s.uz);
  const F a = hn::Div(Set(-1.0F), hn::Add(sign, s.uz));
  const F ax = hn::Mul(s.ux, a);
  const F b = hn::Mul(s.uy, ax);
  const F p_signed = hn::Mul(p, sign);
  // p (1 + sign a ux², sign b, −sign ux) + q (b, sign + a uy², −uy) + cosine u
  const F x = hn::Add(hn::Add(p, hn::Mul(hn::Mul(p_signed, ax), s.ux)),
                      hn::Add(hn::Mul(q, b), hn::Mul(cosine, s.ux)));
  const F y = hn::Add(hn::Add(hn::Mul(p_signed, b),
                              hn::Mul(q, hn::Add(sign, hn::Mul(a, Square(s.uy))))),
                      hn::Mul(cosine, s.uy));
  const F z = hn::Sub(hn::Mul(cosine, s.uz),
                      hn::Add(hn::Mul(p_signed, s.ux), hn::Mul(q, s.uy)));
  const F length2 = hn::Add(hn::Add(Square(x), Square(y)), Square(z));
  const F scale = hn::Sub(Set(1.5F), hn::Mul(Set(0.5F), length2));
  return {hn::Mul(x, scale), hn::Mul(y, scale), hn::Mul(z, scale)};
}

template <class Table>
HWY_ATTR F GatherFloat(const Table& table, I index) {
  return hn::GatherIndex(Floats(), table.data(), index);
}

template <class Table>
HWY_ATTR U GatherWord(const Table& table, I index) {
  return hn::GatherIndex(Words32(), table.data(), index);
}

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace nacre::rigs::monte_carlo::internal
HWY_AFTER_NAMESPACE();
#endif
