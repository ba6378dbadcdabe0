#pragma once

#include "core/random.h"
#include "reconstruct/rd_dataset.h"
#include "tests/support/temp_folder.h"

#include <cmath>
#include <cstdint>

namespace nacre::reconstruct::testing {

using nacre::testing::TempFolder;

/// A small header drawn from a seed.
inline RdHeader RandomHeader(std::uint64_t seed) {
  RandomStream random(seed, 1);
  const auto draw = [&](int low, int high) {
    return low + static_cast<int>(random() % static_cast<unsigned>(high - low + 1));
  };
  RdHeader header;
  header.points_x = draw(1, 6);
  header.points_y = draw(1, 6);
  header.core = 2 * draw(0, 5) + 1;
  header.pitch_mm = 0.05 + random.Uniform();
  header.eta = 1 + random.Uniform();
  const std::vector<std::string> names = {"R", "G", "B", "638nm", "ir"};
  header.channels.assign(names.begin(), names.begin() + draw(1, 5));
  header.provenance = R"({"seed": )" + std::to_string(seed) + "}";
  return header;
}

/// Values over many orders of magnitude, some negative, some invalid.
inline RdDataset RandomDataset(const RdHeader& header, std::uint64_t seed) {
  RandomStream random(seed, 2);
  RdDataset dataset;
  dataset.header = header;
  const auto size = static_cast<std::size_t>(header.PointCount() * header.SliceSize());
  for (std::size_t k = 0; k < size; ++k) {
    const double value = std::pow(10.0, -8 * random.Uniform());
    dataset.rd.push_back(static_cast<float>(random.Uniform() < 0.05 ? -value : value));
    dataset.sigma.push_back(random.UniformFloat());
    dataset.valid.push_back(random.Uniform() < 0.9 ? 1 : 0);
  }
  return dataset;
}

inline RdSlice SliceOf(const RdDataset& dataset, std::int64_t s) {
  const std::ptrdiff_t begin = s * dataset.header.SliceSize();
  const std::ptrdiff_t end = begin + dataset.header.SliceSize();
  return {{dataset.rd.begin() + begin, dataset.rd.begin() + end},
          {dataset.sigma.begin() + begin, dataset.sigma.begin() + end},
          {dataset.valid.begin() + begin, dataset.valid.begin() + end}};
}

}  // namespace nacre::reconstruct::testing
