#include "core/parallel.h"

#include "core/error.h"
#include "core/sanitizers.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/partitioner.h>
#include <tbb/task_arena.h>
#include <thread>
#include <vector>

namespace nacre {
namespace {

#if NACRE_UNDER_TSAN

// ThreadSanitizer doesn't see into oneTBB, and takes all that it does for races: plain
// threads, whose order it knows, leave those of the bodies.
void RunBlocks(std::int64_t block_count,
               int threads,
               const std::function<void(std::int64_t)>& run) {
  std::atomic<std::int64_t> next = 0;
  std::mutex mutex;
  std::exception_ptr first;
  const auto work = [&] {
    try {
      for (std::int64_t b = next++; b < block_count; b = next++) {
        run(b);
      }
    } catch (...) {
      next = block_count;
      const std::lock_guard lock(mutex);
      first = first ? first : std::current_exception();
    }
  };
  {
    std::vector<std::jthread> others;
    for (int n = 1; n < threads; ++n) {
      others.emplace_back(work);
    }
    work();
  }
  if (first) {
    std::rethrow_exception(first);
  }
}

#else

void RunBlocks(std::int64_t block_count,
               int threads,
               const std::function<void(std::int64_t)>& run) {
  tbb::task_arena arena(threads);
  arena.execute([&] {
    tbb::parallel_for(
        tbb::blocked_range<std::int64_t>(0, block_count, 1),
        [&](const tbb::blocked_range<std::int64_t>& range) {
          for (std::int64_t b = range.begin(); b < range.end(); ++b) {
            run(b);
          }
        },
        tbb::simple_partitioner());
  });
}

#endif

}  // namespace

int ThreadCount(int requested) {
  Expect(requested >= 0, "a thread count of 0 or more");
  return requested > 0
             ? requested
             : static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
}

void ParallelFor(std::int64_t count,
                 int thread_count,
                 const std::function<void(std::int64_t)>& body) {
  ParallelForBlocks(count, 1, thread_count, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t i = begin; i < end; ++i) {
      body(i);
    }
  });
}

void ParallelForBlocks(std::int64_t count,
                       std::int64_t block,
                       int thread_count,
                       const std::function<void(std::int64_t, std::int64_t)>& body) {
  Expect(block > 0, "a positive block");
  if (count <= 0) {
    return;
  }
  const std::int64_t block_count = (count + block - 1) / block;
  const auto run = [&](std::int64_t b) {
    body(b * block, std::min(count, (b + 1) * block));
  };
  const int threads = ThreadCount(thread_count);
  if (threads == 1 || block_count == 1) {
    for (std::int64_t b = 0; b < block_count; ++b) {
      run(b);
    }
    return;
  }
  RunBlocks(block_count, threads, run);
}

}  // namespace nacre
