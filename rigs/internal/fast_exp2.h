#pragma once

#include <bit>
#include <cstdint>

namespace nacre::rigs::internal {

/// 2^x to 3e-7 relative for x in [-126, 127], clamped below: straight-line code that
/// vectorises, as std::exp2 doesn't. x is split at the nearest integer; the rest is the
/// Taylor series of exp(t ln 2), |t| ≤ 1/2.
[[gnu::always_inline]] inline float FastExp2(float x) {
  const float clamped = x < -126.0F ? -126.0F : x;
  // Adding 1.5·2²³ leaves the nearest integer in the low bits.
  const float shifted = clamped + 12582912.0F;
  const float t = clamped - (shifted - 12582912.0F);
  float p = 1.5403530e-4F;
  p = p * t + 1.3333558e-3F;
  p = p * t + 9.6181291e-3F;
  p = p * t + 5.5504109e-2F;
  p = p * t + 2.4022651e-1F;
  p = p * t + 6.9314718e-1F;
  p = p * t + 1.0F;
  const std::uint32_t exponent = (std::bit_cast<std::uint32_t>(shifted) + 127U) << 23;
  return p * std::bit_cast<float>(exponent);
}

/// log₂ x to 2e-7 absolute for normal x > 0. The mantissa is brought to [√½, √2); the
/// series of artanh((m − 1) / (m + 1)) converges there at once.
[[gnu::always_inline]] inline float FastLog2(float x) {
  const std::uint32_t bits = std::bit_cast<std::uint32_t>(x);
  const std::uint32_t offset = bits - 0x3F3504F3U;
  const std::int32_t exponent = static_cast<std::int32_t>(offset) >> 23;
  const std::uint32_t mantissa_bits = (offset & 0x007FFFFFU) + 0x3F3504F3U;
  const float m = std::bit_cast<float>(mantissa_bits);
  const float s = (m - 1.0F) / (m + 1.0F);
  const float s2 = s * s;
  float p = 0.22222222F;
  p = p * s2 + 0.28571429F;
  p = p * s2 + 0.4F;
  p = p * s2 + 0.66666667F;
  p = p * s2 + 2.0F;
  return static_cast<float>(exponent) + s * p * 1.44269504F;
}

}  // namespace nacre::rigs::internal
