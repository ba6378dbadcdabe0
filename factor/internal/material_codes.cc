#include "factor/internal/material_codes.h"

#include "core/error.h"

#include <algorithm>
#include <cmath>

namespace nacre::factor::internal {
namespace {

// A step for each `size` values.
std::vector<float> Multiples(const std::vector<float>& values,
                             const std::vector<float>& steps,
                             std::int64_t size) {
  std::vector<float> multiples(values.size());
  for (std::size_t n = 0; n < values.size(); ++n) {
    const float step = steps[n / static_cast<std::size_t>(size)];
    multiples[n] = std::nearbyint(values[n] / step);
    Expect(multiples[n] * step == values[n],
           "values that are whole multiples of steps");
  }
  return multiples;
}

// Returns the least of them, which is then 0.
double MoveToZero(std::vector<float>& multiples) {
  const float least = *std::min_element(multiples.begin(), multiples.end());
  for (float& value : multiples) {
    value -= least;
  }
  return static_cast<double>(least);
}

void ToValues(std::vector<float>& codes,
              const std::vector<float>& steps,
              std::int64_t size,
              double least) {
  for (std::size_t n = 0; n < codes.size(); ++n) {
    codes[n] = static_cast<float>(static_cast<double>(codes[n]) + least) *
               steps[n / static_cast<std::size_t>(size)];
  }
}

std::int64_t KernelValues(const Material& m) {
  return m.KernelSize() * m.KernelCount() * m.cluster_count;
}

}  // namespace

MaterialCodes Encode(const Material& m) {
  MaterialCodes codes;
  codes.f = Multiples(m.f, m.steps.f, m.MapSize());
  codes.h = Multiples(m.h, m.steps.h, KernelValues(m));
  codes.row_scale =
      Multiples(m.row_scale, {m.steps.row_scale}, std::ssize(m.row_scale));
  codes.f_least = MoveToZero(codes.f);
  codes.h_least = MoveToZero(codes.h);
  return codes;
}

void Decode(double f_least, double h_least, Material& m) {
  ToValues(m.f, m.steps.f, m.MapSize(), f_least);
  ToValues(m.h, m.steps.h, KernelValues(m), h_least);
  ToValues(m.row_scale, {m.steps.row_scale}, std::ssize(m.row_scale), 0);
}

float RoundToHalf(float value) {
  int exponent = 0;
  std::frexp(value, &exponent);
  const float step = std::ldexp(1.0F, std::max(exponent - 11, -24));
  return std::nearbyint(value / step) * step;
}

}  // namespace nacre::factor::internal
