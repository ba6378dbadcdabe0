#include "core/parallel.h"

#include "core/error.h"

#include <gtest/gtest.h>

#include <atomic>
#include <mutex>
#include <set>
#include <vector>

namespace nacre {
namespace {

TEST(ParallelFor, VisitsEachIndexOnce) {
  for (const int threads : {1, 2, 3, 0}) {
    std::vector<std::atomic<int>> visits(1001);
    ParallelFor(
        1001, threads, [&](std::int64_t i) { ++visits[static_cast<std::size_t>(i)]; });
    for (const auto& count : visits) {
      ASSERT_EQ(count, 1);
    }
  }
}

TEST(ParallelFor, BlocksDoNotDependOnTheThreads) {
  const auto blocks = [](int threads) {
    std::set<std::pair<std::int64_t, std::int64_t>> seen;
    std::mutex mutex;
    ParallelForBlocks(103, 10, threads, [&](std::int64_t begin, std::int64_t end) {
      const std::lock_guard lock(mutex);
      seen.insert({begin, end});
    });
    return seen;
  };
  EXPECT_EQ(blocks(1).size(), 11U);
  EXPECT_EQ(blocks(1), blocks(2));
  EXPECT_EQ(blocks(1), blocks(3));
}

TEST(ParallelFor, RethrowsTheFirstException) {
  EXPECT_THROW(ParallelFor(100,
                           2,
                           [](std::int64_t i) {
                             if (i == 50) {
                               throw BadData("no");
                             }
                           }),
               Error);
}

TEST(ParallelFor, NothingToDoIsFine) {
  bool is_called = false;
  ParallelFor(0, 2, [&](std::int64_t) { is_called = true; });
  EXPECT_FALSE(is_called);
}

}  // namespace
}  // namespace nacre
