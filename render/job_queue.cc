#include "render/job_queue.h"

#include "core/error.h"
#include "core/parallel.h"
#include "core/ranks.h"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <deque>
#include <exception>
#include <fmt/format.h>
#include <optional>
#include <thread>
#include <utility>

namespace nacre::render {
namespace {

constexpr int kToWorker = 21;
constexpr int kToRoot = 22;

// What a message begins with.
enum class Kind : std::int64_t { kJobs, kAnnouncement, kEnd, kResults, kError };

struct Heading {
  Kind kind;
  std::int64_t batch;
};

std::string Message(Kind kind, std::int64_t batch) {
  const Heading heading{kind, batch};
  return {reinterpret_cast<const char*>(&heading), sizeof(heading)};
}

// One text after the other, each behind its length.
void Append(std::string& bytes, std::string_view text) {
  const std::uint64_t length = text.size();
  bytes.append(reinterpret_cast<const char*>(&length), sizeof(length));
  bytes.append(text);
}

std::string_view Take(std::string_view& bytes) {
  std::uint64_t length = 0;
  Expect(bytes.size() >= sizeof(length), "a length");
  std::memcpy(&length, bytes.data(), sizeof(length));
  bytes.remove_prefix(sizeof(length));
  Expect(bytes.size() >= length, "a whole text");
  const std::string_view text = bytes.substr(0, length);
  bytes.remove_prefix(length);
  return text;
}

Heading TakeHeading(std::string_view& bytes) {
  Heading heading{};
  Expect(bytes.size() >= sizeof(heading), "a heading");
  std::memcpy(&heading, bytes.data(), sizeof(heading));
  bytes.remove_prefix(sizeof(heading));
  return heading;
}

using Clock = std::chrono::steady_clock;

}  // namespace

// The jobs of one Run().
class JobQueue::Batch {
 public:
  Batch(JobQueue& queue, const Jobs& jobs)
      : queue_(queue),
        jobs_(jobs),
        is_done_(static_cast<std::size_t>(jobs.count)),
        left_(jobs.count) {
    for (std::int64_t job = 0; job < jobs.count; ++job) {
      waiting_.push_back(job);
    }
  }

  void Run() {
    last_heard_ = Clock::now();
    while (left_ > 0) {
      Listen();
      for (std::size_t rank = 1; rank < queue_.workers_.size(); ++rank) {
        Feed(rank);
      }
      if (!waiting_.empty()) {
        const bool is_alone = queue_.workers_.size() == 1;
        WorkHere(TakeWaiting(is_alone ? left_ : 2 * ThreadCount(queue_.thread_count_)));
      } else if (left_ > 0) {
        WaitOrRedo();
      }
      jobs_.between();
    }
  }

 private:
  std::vector<std::int64_t> TakeWaiting(std::int64_t count) {
    count = std::min(count, std::ssize(waiting_));
    std::vector<std::int64_t> jobs(waiting_.begin(), waiting_.begin() + count);
    waiting_.erase(waiting_.begin(), waiting_.begin() + count);
    return jobs;
  }

  // Keeps two stretches at a rank, so that it needn't wait for the root; they get
  // shorter, so that all end at about the same time.
  void Feed(std::size_t rank) {
    Worker& worker = queue_.workers_[rank];
    constexpr std::int64_t kLongest = 64;
    while (!worker.is_lost && worker.given.size() < 2 && !waiting_.empty()) {
      const std::int64_t share =
          std::ssize(waiting_) / (4 * std::ssize(queue_.workers_));
      const std::vector<std::int64_t> jobs = TakeWaiting(
          std::clamp<std::int64_t>(share, ThreadCount(queue_.thread_count_), kLongest));
      std::string message = Message(Kind::kJobs, queue_.batch_number_);
      for (const std::int64_t job : jobs) {
        Append(message, jobs_.describe(job));
      }
      queue_.ranks_.Post(static_cast<int>(rank), kToWorker, std::move(message));
      worker.given.push_back({queue_.batch_number_, jobs});
    }
  }

  void Listen() {
    while (const auto message = queue_.workers_.size() > 1 ? queue_.ranks_.Poll(kToRoot)
                                                           : std::nullopt) {
      last_heard_ = Clock::now();
      std::string_view bytes = message->bytes;
      const Heading heading = TakeHeading(bytes);
      Worker& worker = queue_.workers_[static_cast<std::size_t>(message->from)];
      if (heading.kind == Kind::kError) {
        worker.is_lost = true;
        queue_.lost_.push_back(fmt::format("rank {}: {}", message->from, bytes));
        TakeBack(worker);
        continue;
      }
      Expect(!worker.given.empty(), "results of what was given");
      const std::vector<std::int64_t> jobs = std::move(worker.given.front().jobs);
      worker.given.erase(worker.given.begin());
      // Of an earlier batch: done by somebody else since.
      if (heading.batch == queue_.batch_number_) {
        for (const std::int64_t job : jobs) {
          const std::string_view result = Take(bytes);
          if (MarkDone(job)) {
            jobs_.take(job, result);
          }
        }
      }
    }
  }

  void TakeBack(Worker& worker) {
    for (const Stretch& stretch : worker.given) {
      if (stretch.batch == queue_.batch_number_) {
        waiting_.insert(waiting_.end(), stretch.jobs.begin(), stretch.jobs.end());
      }
    }
    worker.given.clear();
  }

  bool MarkDone(std::int64_t job) {
    const auto at = static_cast<std::size_t>(job);
    if (is_done_[at]) {
      return false;
    }
    is_done_[at] = true;
    --left_;
    return true;
  }

  void WorkHere(const std::vector<std::int64_t>& jobs) {
    ParallelFor(std::ssize(jobs), queue_.thread_count_, [&](std::int64_t k) {
      jobs_.here(jobs[static_cast<std::size_t>(k)]);
    });
    for (const std::int64_t job : jobs) {
      MarkDone(job);
    }
  }

  // All is given away. If nothing has come back for long, the root does it itself, the
  // last job first, since ranks begin with the first.
  void WaitOrRedo() {
    constexpr auto kPatience = std::chrono::milliseconds(500);
    if (Clock::now() - last_heard_ < kPatience) {
      std::this_thread::sleep_for(std::chrono::microseconds(100));
      return;
    }
    const auto last = std::find(is_done_.rbegin(), is_done_.rend(), false);
    WorkHere({std::distance(last, is_done_.rend()) - 1});
  }

  JobQueue& queue_;
  const Jobs& jobs_;
  std::deque<std::int64_t> waiting_;
  std::vector<bool> is_done_;
  std::int64_t left_;
  Clock::time_point last_heard_;
};

JobQueue::JobQueue(const Ranks& ranks, int thread_count)
    : ranks_(ranks),
      thread_count_(thread_count),
      workers_(static_cast<std::size_t>(ranks.size())) {}

void JobQueue::Run(const Jobs& jobs) {
  ++batch_number_;
  Batch(*this, jobs).Run();
}

void JobQueue::Announce(const std::string& bytes) {
  for (int rank = 1; rank < ranks_.size(); ++rank) {
    ranks_.Post(rank, kToWorker, Message(Kind::kAnnouncement, 0) + bytes);
  }
}

void JobQueue::Finish() {
  for (int rank = 1; rank < ranks_.size(); ++rank) {
    ranks_.Post(rank, kToWorker, Message(Kind::kEnd, 0));
  }
}

void JobQueue::Serve(
    const std::function<void(std::string_view announced)>& prepare,
    const std::function<std::string(std::string_view description)>& work) {
  bool failed = false;
  for (;;) {
    const auto message = ranks_.Receive(kToWorker);
    std::string_view bytes = message.bytes;
    const Heading heading = TakeHeading(bytes);
    if (heading.kind == Kind::kEnd) {
      return;
    }
    if (failed) {
      continue;
    }
    try {
      if (heading.kind == Kind::kAnnouncement) {
        prepare(bytes);
        continue;
      }
      std::vector<std::string_view> descriptions;
      while (!bytes.empty()) {
        descriptions.push_back(Take(bytes));
      }
      std::vector<std::string> results(descriptions.size());
      ParallelFor(std::ssize(results), thread_count_, [&](std::int64_t k) {
        const auto at = static_cast<std::size_t>(k);
        results[at] = work(descriptions[at]);
      });
      std::string reply = Message(Kind::kResults, heading.batch);
      for (const std::string& result : results) {
        Append(reply, result);
      }
      ranks_.Post(0, kToRoot, std::move(reply));
    } catch (const std::exception& error) {
      // The root goes on without this rank, and says so.
      ranks_.Post(0, kToRoot, Message(Kind::kError, heading.batch) + error.what());
      failed = true;
    }
  }
}

}  // namespace nacre::render
