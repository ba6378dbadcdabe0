#include "reconstruct/internal/binned_picture.h"

#include "core/simd_clones.h"

#include <algorithm>
#include <cstdint>

namespace nacre::reconstruct::internal {
namespace {

// out[x] = upper[2 x] + upper[2 x + 1] + lower[2 x] + lower[2 x + 1].
NACRE_SIMD_CLONES void AddPairs(const float* __restrict upper,
                                const float* __restrict lower,
                                std::size_t count,
                                float* __restrict out) {
  for (std::size_t x = 0; x < count; ++x) {
    out[x] = (upper[2 * x] + upper[2 * x + 1]) + (lower[2 * x] + lower[2 * x + 1]);
  }
}

// Sums over 2 × 2 values of a picture of odd or even sides.
void Halve(const float* in, int width, int height, BinnedPicture& out) {
  const auto w = static_cast<std::size_t>(width);
  const auto out_width = static_cast<std::size_t>(out.width);
  const std::vector<float> nothing(w, 0.0F);
  for (int y = 0; y < out.height; ++y) {
    const float* upper = in + static_cast<std::size_t>(2 * y) * w;
    const float* lower = 2 * y + 1 < height ? upper + w : nothing.data();
    float* row = &out.values[static_cast<std::size_t>(y) * out_width];
    AddPairs(upper, lower, w / 2, row);
    if (w % 2 != 0) {
      row[w / 2] = upper[w - 1] + lower[w - 1];
    }
  }
}

// out[x], x from 1 to count − 2, of a line of 2 · count values: each shared between the
// two nearest bins.
NACRE_SIMD_CLONES void ShareLine(const float* __restrict in,
                                 std::size_t count,
                                 float* __restrict out) {
  for (std::size_t x = 1; x + 1 < count; ++x) {
    out[x] =
        0.75F * (in[2 * x] + in[2 * x + 1]) + 0.25F * (in[2 * x - 1] + in[2 * x + 2]);
  }
}

// The other way round: two values of a line for each of coarse ones, from 1 on.
NACRE_SIMD_CLONES void AddGrownLine(const float* __restrict own,
                                    const float* __restrict other,
                                    std::size_t count,
                                    float* __restrict line,
                                    float* __restrict out) {
  for (std::size_t x = 0; x < count; ++x) {
    line[x] = 0.75F * own[x] + 0.25F * other[x];
  }
  for (std::size_t x = 1; x + 1 < count; ++x) {
    out[2 * x] += 0.75F * line[x] + 0.25F * line[x - 1];
    out[2 * x + 1] += 0.75F * line[x] + 0.25F * line[x + 1];
  }
}

NACRE_SIMD_CLONES void AddScaledClones(const float* __restrict in,
                                       float scale,
                                       std::size_t count,
                                       float* __restrict out) {
  for (std::size_t x = 0; x < count; ++x) {
    out[x] += scale * in[x];
  }
}

}  // namespace

void BinnedPicture::Fill(const std::vector<float>& picture, int picture_width) {
  Halve(picture.data(),
        picture_width,
        static_cast<int>(picture.size()) / picture_width,
        *this);
}

void AddScaled(const float* in, float scale, std::size_t count, float* out) {
  AddScaledClones(in, scale, count, out);
}

void Shrink(const BinnedPicture& fine, BinnedPicture& coarse) {
  const auto width = static_cast<std::size_t>(fine.width);
  const auto count = static_cast<std::size_t>(coarse.width);
  std::vector<float> row(count);
  const auto at = [&](const float* in, std::ptrdiff_t x) {
    const auto last = static_cast<std::ptrdiff_t>(width) - 1;
    return x > last ? 0.0F : in[std::max<std::ptrdiff_t>(0, x)];
  };
  // The bins at the ends: what would go beyond them stays.
  const auto share_end = [&](const float* in, std::size_t x) {
    const auto first = static_cast<std::ptrdiff_t>(2 * x);
    const float before = x == 0 ? in[0] : at(in, first - 1);
    const bool is_last = width % 2 == 0 && x + 1 == count;
    const float after = is_last ? in[width - 1] : at(in, first + 2);
    row[x] = 0.75F * (at(in, first) + at(in, first + 1)) + 0.25F * (before + after);
  };
  std::fill(coarse.values.begin(), coarse.values.end(), 0.0F);
  for (int y = 0; y < fine.height; ++y) {
    const float* in = &fine.values[static_cast<std::size_t>(y) * width];
    ShareLine(in, width / 2, row.data());
    share_end(in, 0);
    share_end(in, width / 2 - (width > 1 ? 1 : 0));
    share_end(in, count - 1);
    const int beside = std::clamp(y / 2 + (y % 2 == 0 ? -1 : 1), 0, coarse.height - 1);
    AddScaled(row.data(),
              0.75F,
              count,
              &coarse.values[static_cast<std::size_t>(y / 2) * count]);
    AddScaled(row.data(),
              0.25F,
              count,
              &coarse.values[static_cast<std::size_t>(beside) * count]);
  }
}

void AddGrown(const BinnedPicture& coarse, BinnedPicture& fine) {
  const auto width = static_cast<std::size_t>(fine.width);
  const auto count = static_cast<std::size_t>(coarse.width);
  std::vector<float> row(count);
  const std::size_t last = count - 1;
  for (int y = 0; y < fine.height; ++y) {
    const int beside = std::clamp(y / 2 + (y % 2 == 0 ? -1 : 1), 0, coarse.height - 1);
    float* out = &fine.values[static_cast<std::size_t>(y) * width];
    AddGrownLine(&coarse.values[static_cast<std::size_t>(y / 2) * count],
                 &coarse.values[static_cast<std::size_t>(beside) * count],
                 count,
                 row.data(),
                 out);
    const auto add_end = [&](std::size_t x) {
      out[2 * x] += 0.75F * row[x] + 0.25F * row[x > 0 ? x - 1 : 0];
      if (2 * x + 1 < width) {
        out[2 * x + 1] += 0.75F * row[x] + 0.25F * row[x < last ? x + 1 : last];
      }
    };
    add_end(0);
    if (last > 0) {
      add_end(last);
    }
  }
}

BinnedPicture WithRim(const BinnedPicture& picture) {
  BinnedPicture padded = BinnedPicture::OfSize(picture.width + 2 * kDarkRim,
                                               picture.height + 2 * kDarkRim);
  for (int y = 0; y < picture.height; ++y) {
    std::copy_n(
        &picture.values[static_cast<std::size_t>(std::int64_t{y} * picture.width)],
        picture.width,
        &padded.values[static_cast<std::size_t>(
            std::int64_t{y + kDarkRim} * padded.width + kDarkRim)]);
  }
  return padded;
}

void AddWithoutRim(const BinnedPicture& padded, BinnedPicture& picture) {
  for (int y = 0; y < picture.height; ++y) {
    AddScaled(
        &padded.values[static_cast<std::size_t>(
            std::int64_t{y + kDarkRim} * padded.width + kDarkRim)],
        1,
        static_cast<std::size_t>(picture.width),
        &picture.values[static_cast<std::size_t>(std::int64_t{y} * picture.width)]);
  }
}

}  // namespace nacre::reconstruct::internal
