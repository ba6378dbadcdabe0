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

constexpr std::uint32_t kModulus = 1U << 24;

// The whole numbers of a row of the sheet's channels, as integers.
using Numbers = std::vector<std::uint32_t>;

// What the numbers before it in its picture say of that at (x, y), x counting from the
// picture's left side at `row`.
std::uint32_t Predict(const std::uint32_t* row, std::size_t stride, int x, int y) {
  const std::uint32_t* at = row + x;
  if (x == 0 || y == 0) {
    return x > 0 ? at[-1] : y > 0 ? *(at - stride) : 0;
  }
  const std::uint32_t left = at[-1];
  const std::uint32_t above = *(at - stride);
  const std::uint32_t corner = *(at - stride - 1);
  const auto [low, high] = std::minmax(left, above);
  return corner >= high ? low : corner <= low ? high : left + above - corner;
}

// Calls use(number, prediction, whether a row of the sheet begins) in the file's order.
template <class Use>
void ForEachNumber(const Sheet& sheet, Numbers& numbers, Use&& use) {
  const auto width = static_cast<std::size_t>(sheet.width);
  const std::size_t stride = width * static_cast<std::size_t>(sheet.columns);
  const std::size_t rows = numbers.size() / stride;
  for (std::size_t r = 0; r < rows; ++r) {
    const auto y = static_cast<int>(r % static_cast<std::size_t>(sheet.height));
    for (std::size_t n = 0; n < stride; ++n) {
      const auto x = static_cast<int>(n % width);
      std::uint32_t* row = &numbers[r * stride + n - static_cast<std::size_t>(x)];
      use(row[x], Predict(row, stride, x, y), n == 0);
    }
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

void Fold(const Sheet& sheet, ExrPart& part) {
  Numbers numbers(part.values.begin(), part.values.end());
  std::uint32_t sum = 0;
  auto* to = part.values.data();
  ForEachNumber(
      sheet, numbers, [&](std::uint32_t number, std::uint32_t guess, bool begins) {
        const std::uint32_t more = (number - guess) % kModulus;
        const std::uint32_t folded =
            more < kModulus / 2 ? 2 * more : 2 * (kModulus - more) - 1;
        sum = ((begins ? 0 : sum) + folded) % kModulus;
        *to++ = static_cast<float>(sum);
      });
}

void Unfold(const Sheet& sheet, ExrPart& part) {
  Numbers numbers(part.values.size());
  std::uint32_t sum = 0;
  const auto* from = part.values.data();
  ForEachNumber(
      sheet, numbers, [&](std::uint32_t& number, std::uint32_t guess, bool begins) {
        const auto next = static_cast<std::uint32_t>(*from++) % kModulus;
        const std::uint32_t folded = (next - (begins ? 0 : sum)) % kModulus;
        sum = next;
        const std::uint32_t more =
            folded % 2 == 0 ? folded / 2 : kModulus - (folded + 1) / 2;
        number = (guess + more) % kModulus;
      });
  std::copy(numbers.begin(), numbers.end(), part.values.begin());
}

float RoundToHalf(float value) {
  int exponent = 0;
  std::frexp(value, &exponent);
  const float step = std::ldexp(1.0F, std::max(exponent - 11, -24));
  return std::nearbyint(value / step) * step;
}

}  // namespace nacre::factor::internal
