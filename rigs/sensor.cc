#include "rigs/sensor.h"

#include "core/error.h"
#include "core/parallel.h"
#include "core/random.h"
#include "core/simd_clones.h"
#include "rigs/internal/fast_exp2.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <limits>

namespace nacre::rigs {
namespace {

// Two words a pixel, so a Philox block serves two pixels. Pixels are done in pieces
// that fit the first cache.
constexpr std::size_t kSensorPiece = 1024;
constexpr std::size_t kBlocks = kSensorPiece / 2;
constexpr std::size_t kGroup = 64;

// Above it a Poisson variable is a Gaussian one with its skewness put right, rounded.
constexpr float kGaussianAbove = 20.0F;

struct Draws {
  std::uint32_t photon[kSensorPiece];  // words that decide the number of electrons
  std::uint32_t read[kSensorPiece];    // words that decide the read noise
};

// The blocks of pixels 2 b and 2 b + 1, b from `first_block` on. Philox() of
// core/random.h written over columns.
NACRE_SIMD_CLONES void Draw(const Exposure& exposure,
                            std::uint64_t first_block,
                            Draws& draws) {
  const auto picture_low = static_cast<std::uint32_t>(exposure.picture_number);
  const auto picture_high = static_cast<std::uint32_t>(exposure.picture_number >> 32);
  const auto seed_low = static_cast<std::uint32_t>(exposure.seed);
  const auto seed_high = static_cast<std::uint32_t>(exposure.seed >> 32);
  const auto first = static_cast<std::uint32_t>(first_block);
  for (std::size_t b = 0; b < kBlocks; ++b) {
    const std::array<std::uint32_t, 4> word = Philox(
        {first + static_cast<std::uint32_t>(b), 0x6E616372U, picture_low, picture_high},
        {seed_low, seed_high});
    draws.photon[b] = word[0];
    draws.read[b] = word[1];
    draws.photon[b + kBlocks] = word[2];
    draws.read[b + kBlocks] = word[3];
  }
}

// A standard normal variable from 24 bits: √2 erf⁻¹(2u − 1), by Giles' polynomials
// [Giles12, table 5].
[[gnu::always_inline]] inline float Normal(std::uint32_t word) {
  // (n + ½) / 2²³ − 1 with n < 2²⁴: exact, symmetric, never ±1.
  const float x =
      (static_cast<float>(static_cast<std::int32_t>(word >> 8)) - 8388607.5F) *
      0x1p-23F;
  const float w =
      -0.69314718F * internal::FastLog2(std::max((1.0F - x) * (1.0F + x), 1e-9F));
  const float a = w - 2.5F;
  float central = 2.81022636e-08F;
  central = 3.43273939e-07F + central * a;
  central = -3.5233877e-06F + central * a;
  central = -4.39150654e-06F + central * a;
  central = 0.00021858087F + central * a;
  central = -0.00125372503F + central * a;
  central = -0.00417768164F + central * a;
  central = 0.246640727F + central * a;
  central = 1.50140941F + central * a;
  const float b = std::sqrt(w) - 3.0F;
  float tail = -0.000200214257F;
  tail = 0.000100950558F + tail * b;
  tail = 0.00134934322F + tail * b;
  tail = -0.00367342844F + tail * b;
  tail = 0.00573950773F + tail * b;
  tail = -0.0076224613F + tail * b;
  tail = 0.00943887047F + tail * b;
  tail = 1.00167406F + tail * b;
  tail = 2.83297682F + tail * b;
  return 1.41421356F * x * (w < 5.0F ? central : tail);
}

NACRE_SIMD_CLONES void DrawElectrons(const float* __restrict mean,
                                     const std::uint32_t* __restrict word,
                                     float full_well,
                                     std::size_t count,
                                     float* __restrict electrons) {
  for (std::size_t k = 0; k < count; ++k) {
    const float z = Normal(word[k]);
    const float skew = (z * z - 1.0F) * (1.0F / 6.0F);  // [Cornish38], first order
    const float drawn = mean[k] + std::sqrt(mean[k]) * z + skew;
    const float whole = std::floor(drawn + 0.5F);
    electrons[k] = std::min(full_well, std::max(0.0F, whole));
  }
}

// Poisson by inversion, a column at a time: the number of partial sums of the
// distribution that u exceeds. Pixels that aren't dark keep what they have.
NACRE_SIMD_CLONES void DrawFewElectrons(const float* __restrict mean,
                                        const std::uint32_t* __restrict word,
                                        int most_electrons,
                                        std::size_t count,
                                        float* __restrict electrons) {
  float u[kGroup];
  float term[kGroup];
  float sum[kGroup];
  float few[kGroup];
  for (std::size_t k = 0; k < count; ++k) {
    u[k] =
        (static_cast<float>(static_cast<std::int32_t>(word[k] >> 8)) + 0.5F) * 0x1p-24F;
    term[k] = internal::FastExp2(-1.44269504F * std::min(mean[k], kGaussianAbove));
    sum[k] = term[k];
    few[k] = 0.0F;
  }
  constexpr int kBetweenLooks = 4;
  for (int n = 1; n <= most_electrons; ++n) {
    const float per_n = 1.0F / static_cast<float>(n);
    for (std::size_t k = 0; k < count; ++k) {
      few[k] += u[k] > sum[k] ? 1.0F : 0.0F;
      term[k] *= mean[k] * per_n;
      sum[k] += term[k];
    }
    if (n % kBetweenLooks == 0) {
      // Pixels that exceed their sum still: when there are none, none will.
      std::int32_t open = 0;
      for (std::size_t k = 0; k < count; ++k) {
        open |= u[k] > sum[k] && mean[k] < kGaussianAbove ? 1 : 0;
      }
      if (open == 0) {
        break;
      }
    }
  }
  for (std::size_t k = 0; k < count; ++k) {
    electrons[k] = mean[k] < kGaussianAbove ? few[k] : electrons[k];
  }
}

// The largest of those below `limit`, 0 if there is none. Floats that aren't negative
// are in the order of their bits, and the largest integer is found by blends alone.
NACRE_SIMD_CLONES float LargestBelow(const float* mean,
                                     std::size_t count,
                                     float limit) {
  std::int32_t largest = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const auto bits = std::bit_cast<std::int32_t>(mean[k] < limit ? mean[k] : 0.0F);
    largest = largest > bits ? largest : bits;
  }
  return std::bit_cast<float>(largest);
}

// The number of electrons that a mean below kGaussianAbove exceeds once in 10⁸ pixels
// or less.
int MostElectrons(const float* mean, std::size_t count) {
  const float brightest = LargestBelow(mean, count, kGaussianAbove);
  return brightest > 0
             ? static_cast<int>(std::ceil(brightest + 6 * std::sqrt(brightest))) + 5
             : 0;
}

NACRE_SIMD_CLONES void Means(const float* __restrict rates,
                             float exposure_us,
                             float dark,
                             std::size_t count,
                             float* __restrict mean) {
  for (std::size_t k = 0; k < count; ++k) {
    mean[k] = rates[k] * exposure_us + dark;
  }
}

NACRE_SIMD_CLONES void Convert(const SensorModel& sensor,
                               const float* __restrict electrons,
                               const float* __restrict row_electrons,
                               const std::uint32_t* __restrict word,
                               std::size_t count,
                               std::uint16_t* __restrict counts) {
  const auto curve =
      static_cast<float>(sensor.nonlinearity / sensor.full_well_electrons);
  const auto read_noise = static_cast<float>(sensor.read_noise_electrons);
  const auto per_electron = static_cast<float>(1 / sensor.electrons_per_count);
  const auto offset = static_cast<float>(sensor.offset_counts);
  const auto most = static_cast<float>(sensor.MaxCount());
  for (std::size_t k = 0; k < count; ++k) {
    const float kept = electrons[k] * (1.0F - curve * electrons[k]);
    const float signal = kept + row_electrons[k] + read_noise * Normal(word[k]);
    const float value = offset + signal * per_electron;
    const float clipped = std::min(most, std::max(0.0F, value));
    counts[k] = static_cast<std::uint16_t>(static_cast<std::int32_t>(clipped + 0.5F));
  }
}

// Of the pixels from `begin` on. A stream of its own, by the second word of the
// counter.
void DrawRows(const SensorModel& sensor,
              const Exposure& exposure,
              std::size_t begin,
              std::size_t count,
              float* row_electrons) {
  std::fill_n(row_electrons, count, 0.0F);
  if (sensor.row_noise_electrons <= 0 || exposure.row_px <= 0) {
    return;
  }
  const auto width = static_cast<std::size_t>(exposure.row_px);
  for (std::size_t k = 0; k < count;) {
    const std::size_t row = (begin + k) / width;
    const std::size_t end = std::min(count, (row + 1) * width - begin);
    const auto word =
        Philox({static_cast<std::uint32_t>(row),
                0x726F7773U,
                static_cast<std::uint32_t>(exposure.picture_number),
                static_cast<std::uint32_t>(exposure.picture_number >> 32)},
               {static_cast<std::uint32_t>(exposure.seed),
                static_cast<std::uint32_t>(exposure.seed >> 32)})[0];
    std::fill(row_electrons + k,
              row_electrons + end,
              static_cast<float>(sensor.row_noise_electrons) * Normal(word));
    k = end;
  }
}

void ExposePiece(const SensorModel& sensor,
                 const Exposure& exposure,
                 std::size_t begin,
                 std::span<const float> rates,
                 std::span<std::uint16_t> counts) {
  Draws draws;
  Draw(exposure, begin / 2, draws);
  float mean[kSensorPiece];
  float electrons[kSensorPiece] = {};
  const auto exposure_us = static_cast<float>(exposure.exposure_us);
  const auto dark =
      static_cast<float>(sensor.dark_electrons_per_us * exposure.exposure_us);
  const std::size_t count = rates.size();
  Means(rates.data(), exposure_us, dark, count, mean);
  constexpr float kNoLimit = std::numeric_limits<float>::infinity();
  if (LargestBelow(mean, count, kNoLimit) >= kGaussianAbove) {
    DrawElectrons(mean,
                  draws.photon,
                  static_cast<float>(sensor.full_well_electrons),
                  count,
                  electrons);
  }
  // In short groups, so that only the neighbours of a bright pixel pay for it.
  for (std::size_t at = 0; at < count; at += kGroup) {
    const std::size_t size = std::min(kGroup, count - at);
    if (const int most = MostElectrons(mean + at, size); most > 0) {
      DrawFewElectrons(mean + at, draws.photon + at, most, size, electrons + at);
    }
  }
  float row_electrons[kSensorPiece];
  DrawRows(sensor, exposure, begin, count, row_electrons);
  Convert(sensor, electrons, row_electrons, draws.read, count, counts.data());
}

}  // namespace

void Expose(const SensorModel& sensor,
            const Exposure& exposure,
            std::span<const float> rates_electrons_per_us,
            std::span<std::uint16_t> counts,
            int thread_count) {
  Expect(rates_electrons_per_us.size() == counts.size(), "a rate for each pixel");
  Expect(counts.size() < (std::size_t{1} << 32), "fewer than 2^32 pixels");
  const auto size = static_cast<std::int64_t>(counts.size());
  constexpr std::int64_t kPiecesPerTask = 16;
  constexpr auto kStep = static_cast<std::int64_t>(kSensorPiece);
  ParallelForBlocks(
      size, kStep * kPiecesPerTask, thread_count, [&](auto begin, auto end) {
        for (std::int64_t at = begin; at < end; at += kStep) {
          const auto from = static_cast<std::size_t>(at);
          const auto count = static_cast<std::size_t>(std::min(kStep, end - at));
          ExposePiece(sensor,
                      exposure,
                      from,
                      rates_electrons_per_us.subspan(from, count),
                      counts.subspan(from, count));
        }
      });
}

}  // namespace nacre::rigs
