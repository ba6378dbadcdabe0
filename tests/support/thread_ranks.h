#pragma once

#include "core/ranks.h"

#include <algorithm>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

namespace nacre::testing {

/// Ranks that are threads of this process, with the same collective calls as real ones.
class ThreadRanks : public Ranks {
 public:
  struct Letter {
    int to;
    int tag;
    RankMessage message;
  };
  struct Office {
    std::mutex mutex;
    std::deque<Letter> letters;
  };

  ThreadRanks(int rank, int size, Office& office)
      : Ranks(rank, size), office_(office) {}

 private:
  void DoPost(int to, int tag, std::string bytes) const override {
    const std::lock_guard lock(office_.mutex);
    office_.letters.push_back({to, tag, {rank(), std::move(bytes)}});
  }

  std::optional<RankMessage> DoPoll(int tag, int from) const override {
    const std::lock_guard lock(office_.mutex);
    const auto found = std::find_if(
        office_.letters.begin(), office_.letters.end(), [&](const Letter& letter) {
          return letter.to == rank() && letter.tag == tag &&
                 (from == kAnyRank || letter.message.from == from);
        });
    if (found == office_.letters.end()) {
      return std::nullopt;
    }
    RankMessage message = std::move(found->message);
    office_.letters.erase(found);
    return message;
  }

  Office& office_;
};

/// Calls body(ranks) on `size` ranks at a time; rethrows what the lowest threw. All
/// must throw if one does: the others would wait for it.
inline void OnThreadRanks(int size, const std::function<void(const Ranks&)>& body) {
  ThreadRanks::Office office;
  std::vector<std::exception_ptr> errors(static_cast<std::size_t>(size));
  {
    std::vector<std::jthread> threads;
    threads.reserve(errors.size());
    for (int rank = 0; rank < size; ++rank) {
      threads.emplace_back([&, rank] {
        try {
          body(ThreadRanks(rank, size, office));
        } catch (...) {
          errors[static_cast<std::size_t>(rank)] = std::current_exception();
        }
      });
    }
  }
  for (const std::exception_ptr& error : errors) {
    if (error) {
      std::rethrow_exception(error);
    }
  }
}

}  // namespace nacre::testing
