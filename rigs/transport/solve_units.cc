#include "rigs/transport/solve_units.h"

#include "core/error.h"
#include "core/parallel.h"
#include "core/ranks.h"

#include <algorithm>
#include <cstring>
#include <string>
#include <string_view>

namespace nacre::rigs {
namespace {

using Values = std::vector<float>;

// The units of a rank, each as the number of its values and the values.
std::string Packed(const std::vector<Values>& units) {
  std::string bytes;
  for (const Values& values : units) {
    const std::uint64_t count = values.size();
    bytes.append(reinterpret_cast<const char*>(&count), sizeof(count));
    bytes.append(reinterpret_cast<const char*>(values.data()), count * sizeof(float));
  }
  return bytes;
}

// Takes the first unit off the front of what Packed() made.
Values TakeUnit(std::string_view& bytes) {
  std::uint64_t count = 0;
  Expect(bytes.size() >= sizeof(count), "a unit's size");
  std::memcpy(&count, bytes.data(), sizeof(count));
  bytes.remove_prefix(sizeof(count));
  Expect(bytes.size() / sizeof(float) >= count, "a unit's values");
  Values values(count);
  std::memcpy(values.data(), bytes.data(), count * sizeof(float));
  bytes.remove_prefix(count * sizeof(float));
  return values;
}

// The units first, first + step, … below last.
std::vector<Values> SolveEvery(std::int64_t first,
                               std::int64_t last,
                               std::int64_t step,
                               int thread_count,
                               const std::function<Values(std::int64_t)>& solve) {
  const std::int64_t count = first < last ? (last - first + step - 1) / step : 0;
  std::vector<Values> solved(static_cast<std::size_t>(count));
  ParallelFor(count, thread_count, [&](std::int64_t k) {
    solved[static_cast<std::size_t>(k)] = solve(first + k * step);
  });
  return solved;
}

}  // namespace

void SolveUnits(
    const UnitSharing& sharing,
    std::int64_t count,
    const std::function<std::vector<float>(std::int64_t unit)>& solve,
    const std::function<void(std::int64_t unit, std::span<const float> values)>& use) {
  const std::int64_t ranks = sharing.ranks == nullptr ? 1 : sharing.ranks->size();
  const std::int64_t rank = sharing.ranks == nullptr ? 0 : sharing.ranks->rank();
  const std::int64_t round =
      std::max(sharing.at_once, ranks * ThreadCount(sharing.thread_count));
  for (std::int64_t first = 0; first < count; first += round) {
    const std::int64_t last = std::min(count, first + round);
    const std::vector<Values> mine =
        SolveEvery(first + rank, last, ranks, sharing.thread_count, solve);
    if (ranks == 1) {
      for (std::int64_t unit = first; unit < last; ++unit) {
        use(unit, mine[static_cast<std::size_t>(unit - first)]);
      }
      continue;
    }
    const std::vector<std::string> all = sharing.ranks->Gather(Packed(mine));
    if (rank != 0) {
      continue;
    }
    std::vector<std::string_view> left(all.begin(), all.end());
    for (std::int64_t unit = first; unit < last; ++unit) {
      use(unit, TakeUnit(left[static_cast<std::size_t>((unit - first) % ranks)]));
    }
  }
}

}  // namespace nacre::rigs
