#pragma once

#include "core/ranks.h"

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

namespace nacre {

/// What ranks did of a work, put together; without ranks nothing is to be done.

/// Collective: `values` are rows of equal size, of which each rank has those of
/// share_of(rank, size); afterwards all ranks have all.
template <class T, class ShareOfRank>
void JoinSharesBy(std::int64_t row_count,
                  const Ranks* ranks,
                  std::span<T> values,
                  ShareOfRank&& share_of) {
  if (ranks == nullptr || ranks->size() == 1 || row_count == 0) {
    return;
  }
  const std::size_t width = values.size() / static_cast<std::size_t>(row_count);
  const auto part = [&](int rank) {
    const RankShare share = share_of(rank, ranks->size());
    return values.subspan(static_cast<std::size_t>(share.begin) * width,
                          static_cast<std::size_t>(share.end - share.begin) * width);
  };
  const auto all = ranks->AllGather(ToBytes(std::span<const T>(part(ranks->rank()))));
  for (int rank = 0; rank < ranks->size(); ++rank) {
    const auto its = FromBytes<T>(all[static_cast<std::size_t>(rank)]);
    std::copy(its.begin(), its.end(), part(rank).begin());
  }
}

/// Collective: the same for the shares of ShareOf.
template <class T>
void JoinShares(std::int64_t row_count, const Ranks* ranks, std::span<T> values) {
  JoinSharesBy(row_count, ranks, values, [&](int rank, int size) {
    return ShareOf(row_count, rank, size);
  });
}

/// Collective: `values` are planes, [plane][row][x], of which each rank has the rows of
/// ShareOf(row_count, rank, size) in all planes; afterwards all ranks have all.
template <class T>
void JoinPlanes(std::int64_t plane_count,
                std::int64_t row_count,
                const Ranks* ranks,
                std::span<T> values) {
  if (ranks == nullptr || ranks->size() == 1 || values.empty()) {
    return;
  }
  const auto planes = static_cast<std::size_t>(plane_count);
  const std::size_t plane = values.size() / planes;
  const std::size_t width = plane / static_cast<std::size_t>(row_count);
  const auto part = [&](int rank, std::size_t p) {
    const RankShare share = ShareOf(row_count, rank, ranks->size());
    return values.subspan(p * plane + static_cast<std::size_t>(share.begin) * width,
                          static_cast<std::size_t>(share.end - share.begin) * width);
  };
  std::vector<T> own;
  for (std::size_t p = 0; p < planes; ++p) {
    const std::span<T> rows = part(ranks->rank(), p);
    own.insert(own.end(), rows.begin(), rows.end());
  }
  const auto all = ranks->AllGather(ToBytes(std::span<const T>(own)));
  for (int rank = 0; rank < ranks->size(); ++rank) {
    const auto its = FromBytes<T>(all[static_cast<std::size_t>(rank)]);
    auto next = its.begin();
    for (std::size_t p = 0; p < planes; ++p) {
      const std::span<T> rows = part(rank, p);
      std::copy_n(next, rows.size(), rows.begin());
      next += std::ssize(rows);
    }
  }
}

/// Collective: the sum of `count` vectors, of which each rank has those of its share in
/// `own`, added one after the other in their order: the bits are those of one process,
/// for float and double. In `total`, on all ranks. Takes as long as there are ranks
/// with a vector; for many of them see core/lot_sum.h.
template <class T>
void SumInOrder(std::int64_t count,
                std::span<const std::span<const T>> own,
                const Ranks* ranks,
                std::span<T> total) {
  constexpr int kTag = 998;
  const int size = ranks == nullptr ? 1 : ranks->size();
  const int rank = ranks == nullptr ? 0 : ranks->rank();
  std::vector<int> owners;
  for (int other = 0; other < size; ++other) {
    const RankShare share = ShareOf(count, other, size);
    if (share.end > share.begin) {
      owners.push_back(other);
    }
  }
  std::fill(total.begin(), total.end(), T{0});
  const auto place = std::find(owners.begin(), owners.end(), rank);
  const auto take = [&](int from) {
    const auto sum = FromBytes<T>(ranks->Receive(kTag, from).bytes);
    std::copy(sum.begin(), sum.end(), total.begin());
  };
  const auto give = [&](int to) {
    ranks->Post(to, kTag, ToBytes(std::span<const T>(total)));
  };
  if (place != owners.end()) {
    std::size_t next = 0;
    if (place == owners.begin()) {
      std::copy(own[0].begin(), own[0].end(), total.begin());
      next = 1;
    } else {
      take(*(place - 1));
    }
    for (; next < own.size(); ++next) {
      for (std::size_t k = 0; k < total.size(); ++k) {
        total[k] += own[next][k];
      }
    }
    if (place + 1 != owners.end()) {
      give(*(place + 1));
    } else if (rank != 0) {
      give(0);
    }
  }
  if (size == 1 || owners.empty()) {
    return;
  }
  if (rank == 0 && owners.back() != 0) {
    take(owners.back());
  }
  std::string bytes = ToBytes(std::span<const T>(total));
  ranks->Broadcast(bytes);
  const auto sum = FromBytes<T>(bytes);
  std::copy(sum.begin(), sum.end(), total.begin());
}

}  // namespace nacre
