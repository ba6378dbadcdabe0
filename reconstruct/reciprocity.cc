#include "reconstruct/reciprocity.h"

#include "core/random.h"
#include "reconstruct/internal/slice_features.h"

#include <algorithm>
#include <cmath>

namespace nacre::reconstruct {

ReciprocityFigures MeasureReciprocity(RdReader& reader,
                                      std::int64_t slices,
                                      std::uint64_t seed) {
  constexpr int kPairs = 12;
  const RdHeader& header = reader.header();
  RandomStream random(seed, 0x72656369);
  ReciprocityFigures figures;
  double difference2 = 0;
  double noise2 = 0;
  for (const std::int64_t s :
       internal::SampleSlices(header.PointCount(), slices, seed)) {
    const int i = static_cast<int>(s % header.points_x);
    const int j = static_cast<int>(s / header.points_x);
    const RdSlice there = reader.ReadSlice(i, j);
    for (int pair = 0; pair < kPairs; ++pair) {
      const int u = static_cast<int>(random.Uniform() * header.core);
      const int v = static_cast<int>(random.Uniform() * header.core);
      const int to_i = i + u - header.Radius();
      const int to_j = j + v - header.Radius();
      if (to_i < 0 || to_i >= header.points_x || to_j < 0 || to_j >= header.points_y ||
          (to_i == i && to_j == j)) {
        continue;
      }
      const RdSlice back = reader.ReadSlice(to_i, to_j);
      for (std::int64_t c = 0; c < std::ssize(header.channels); ++c) {
        const auto at =
            static_cast<std::size_t>(c * header.WindowSize() + v * header.core + u);
        const auto mirrored = static_cast<std::size_t>((c + 1) * header.WindowSize() -
                                                       1 - (v * header.core + u));
        const auto a = static_cast<double>(there.rd[at]);
        const auto b = static_cast<double>(back.rd[mirrored]);
        const double variance = std::pow(static_cast<double>(there.sigma[at]), 2) +
                                std::pow(static_cast<double>(back.sigma[mirrored]), 2);
        const double mean = 0.5 * (a + b);
        if (there.valid[at] == 0 || back.valid[mirrored] == 0 ||
            !(mean > 3 * std::sqrt(variance))) {
          continue;
        }
        difference2 += (a - b) * (a - b) / (mean * mean);
        noise2 += variance / (mean * mean);
        ++figures.pair_count;
      }
    }
  }
  const auto count = static_cast<double>(std::max<std::int64_t>(1, figures.pair_count));
  figures.difference = std::sqrt(difference2 / count);
  figures.noise = std::sqrt(noise2 / count);
  figures.asymmetry = std::sqrt(std::max(0.0, difference2 - noise2) / count);
  return figures;
}

}  // namespace nacre::reconstruct
