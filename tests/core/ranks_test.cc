#include "core/ranks.h"

#include "core/lot_sum.h"
#include "core/random.h"
#include "core/rank_shares.h"
#include "tests/support/thread_ranks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace nacre {
namespace {

using nacre::testing::OnThreadRanks;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(Ranks, ShareEverythingOnceInOrder) {
  for (const int size : {1, 2, 3, 5, 8}) {
    for (const std::int64_t count : {0, 1, 3, 64, 1001}) {
      std::int64_t next = 0;
      for (int rank = 0; rank < size; ++rank) {
        const RankShare share = ShareOf(count, rank, size);
        EXPECT_EQ(share.begin, next);
        EXPECT_LE(share.end - share.begin, count / size + 1);
        next = share.end;
      }
      EXPECT_EQ(next, count);
    }
  }
}

TEST(Ranks, CollectiveCallsReachAll) {
  for (const int size : {1, 2, 3, 4, 7}) {
    OnThreadRanks(size, [size](const Ranks& ranks) {
      std::int64_t values[] = {ranks.rank(), 1};
      ranks.Sum(values);
      EXPECT_THAT(values, ElementsAre(size * (size - 1) / 2, size));
      std::string word = ranks.IsRoot() ? "word" : "";
      ranks.Broadcast(word);
      EXPECT_EQ(word, "word");
      // Of unequal lengths, one of them 0.
      const std::string own(static_cast<std::size_t>(ranks.rank()), 'x');
      const auto all = ranks.AllGather(own);
      ASSERT_EQ(std::ssize(all), size);
      for (std::size_t rank = 0; rank < all.size(); ++rank) {
        EXPECT_EQ(all[rank].size(), rank);
      }
      EXPECT_EQ(ranks.Gather(own).size(), ranks.IsRoot() ? all.size() : 0U);
      ranks.Barrier();
    });
  }
}

TEST(Ranks, MessagesOfATagKeepTheirOrderAndAreCounted) {
  OnThreadRanks(2, [](const Ranks& ranks) {
    if (ranks.IsRoot()) {
      ranks.Post(1, 7, "first");
      ranks.Post(1, 8, "other");
      ranks.Post(1, 7, "second");
      EXPECT_EQ(ranks.traffic().bytes_sent, 16);
      EXPECT_EQ(ranks.traffic().messages_sent, 3);
      return;
    }
    EXPECT_EQ(ranks.Receive(8).bytes, "other");
    EXPECT_EQ(ranks.Receive(7).bytes, "first");
    EXPECT_EQ(ranks.Receive(7, 0).bytes, "second");
    EXPECT_FALSE(ranks.Poll(7));
    EXPECT_EQ(ranks.traffic().bytes_received, 16);
    EXPECT_EQ(ranks.traffic().messages_received, 3);
  });
}

std::vector<double> Lot(std::int64_t lot) {
  RandomStream random(3, static_cast<std::uint64_t>(lot));
  // Of so unlike sizes that each order of adding rounds differently.
  return {random.Uniform(), std::ldexp(random.Uniform(), static_cast<int>(lot % 40))};
}

std::vector<double> SumOf(std::int64_t count, const Ranks* ranks) {
  LotSum sum(count, ranks);
  const RankShare own = ShareOf(count, ranks);
  for (std::int64_t lot = own.begin; lot < own.end; ++lot) {
    sum.Add(Lot(lot));
  }
  return sum.Finish();
}

TEST(LotSum, HasTheSameBitsForAnyNumberOfRanks) {
  for (const std::int64_t count : {1, 2, 3, 7, 64, 97}) {
    const std::vector<double> alone = SumOf(count, nullptr);
    double plain = 0;
    for (std::int64_t lot = 0; lot < count; ++lot) {
      plain += Lot(lot)[1];
    }
    EXPECT_NEAR(alone[1], plain, 1e-12 * plain);
    for (const int size : {2, 3, 4, 8}) {
      OnThreadRanks(size, [&](const Ranks& ranks) {
        EXPECT_EQ(SumOf(count, &ranks), alone) << count << " lots, " << size;
      });
    }
  }
  EXPECT_THAT(SumOf(0, nullptr), IsEmpty());
}

TEST(SumInOrder, HasTheBitsOfALoop) {
  constexpr std::int64_t kCount = 6;
  std::vector<std::vector<float>> vectors;
  std::vector<float> expected(5, 0.0F);
  for (std::int64_t n = 0; n < kCount; ++n) {
    auto& vector = vectors.emplace_back();
    for (std::size_t k = 0; k < expected.size(); ++k) {
      vector.push_back(1 /
                       static_cast<float>(1 + 7 * n + static_cast<std::int64_t>(k)));
      expected[k] += vector.back();
    }
  }
  for (const int size : {1, 2, 3, 4, 8}) {
    OnThreadRanks(size, [&](const Ranks& ranks) {
      const RankShare share = ShareOf(kCount, &ranks);
      const std::vector<std::span<const float>> own(vectors.begin() + share.begin,
                                                    vectors.begin() + share.end);
      std::vector<float> total(expected.size(), 5.0F);
      SumInOrder<float>(kCount, own, &ranks, total);
      EXPECT_EQ(total, expected) << size;
    });
  }
  std::vector<float> nothing(2, 5.0F);
  SumInOrder<float>(0, {}, nullptr, nothing);
  EXPECT_EQ(nothing, std::vector<float>(2, 0.0F));
}

TEST(JoinShares, GivesAllRowsToAll) {
  const std::vector<int> all{1, 2, 3, 4, 5, 6, 7, 8, 9, 10};  // five rows of two
  for (const int size : {1, 2, 3, 7}) {
    OnThreadRanks(size, [&](const Ranks& ranks) {
      std::vector<int> values(all.size(), 0);
      const RankShare share = ShareOf(5, &ranks);
      std::copy(all.begin() + 2 * share.begin,
                all.begin() + 2 * share.end,
                values.begin() + 2 * share.begin);
      JoinShares(5, &ranks, std::span(values));
      EXPECT_EQ(values, all) << size;
    });
  }
}

TEST(Ranks, TheLauncherIsFoundInTheEnvironment) {
  ::unsetenv("OMPI_COMM_WORLD_RANK");
  ::unsetenv("OMPI_COMM_WORLD_SIZE");
  EXPECT_FALSE(FindLauncher());
  ::setenv("OMPI_COMM_WORLD_RANK", "2", 1);
  ::setenv("OMPI_COMM_WORLD_SIZE", "4", 1);
  ASSERT_TRUE(FindLauncher());
  EXPECT_EQ(FindLauncher()->rank, 2);
  EXPECT_EQ(FindLauncher()->size, 4);
  ::setenv("OMPI_COMM_WORLD_SIZE", "four", 1);
  EXPECT_FALSE(FindLauncher());
  ::unsetenv("OMPI_COMM_WORLD_RANK");
  ::unsetenv("OMPI_COMM_WORLD_SIZE");
}

}  // namespace
}  // namespace nacre
