#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace nacre {
class Ranks;
}

namespace nacre::render {

/// Many short jobs, done by whichever rank is free. The root hands them out in
/// stretches, two of them ahead for each other rank, and works too. What a job gives
/// must not depend on who does it: a job whose rank reports an error or isn't heard of
/// again is done by another.
class JobQueue {
 public:
  /// `thread_count`: of each rank.
  JobQueue(const Ranks& ranks, int thread_count);

  /// What the root has to know of its jobs.
  struct Jobs {
    std::int64_t count = 0;
    /// All that another rank needs to know.
    std::function<std::string(std::int64_t job)> describe;
    /// Does it at the root itself, on one of several threads.
    std::function<void(std::int64_t job)> here;
    /// Takes what another rank made of it, once.
    std::function<void(std::int64_t job, std::string_view result)> take;
    /// Called often, while nothing is half done at the root.
    std::function<void()> between;
  };
  /// At the root: returns when all jobs are done. Throws what `here` throws.
  void Run(const Jobs& jobs);

  /// At the root: something that all others need before the jobs that follow.
  void Announce(const std::string& bytes);

  /// At the root: lets the others return from Serve().
  void Finish();

  /// At the root: what ranks said that are given no more jobs, "rank 3: …".
  const std::vector<std::string>& lost() const { return lost_; }

  /// At other ranks: until the root has no more jobs. `work` is called on several
  /// threads; an error that it or `prepare` throws goes to the root.
  void Serve(const std::function<void(std::string_view announced)>& prepare,
             const std::function<std::string(std::string_view description)>& work);

 private:
  struct Stretch {
    std::int64_t batch;  ///< the number of the Run() it is of
    std::vector<std::int64_t> jobs;
  };
  struct Worker {
    std::vector<Stretch> given;  ///< first given first
    bool is_lost = false;
  };
  class Batch;

  const Ranks& ranks_;
  int thread_count_;
  std::int64_t batch_number_ = 0;
  std::vector<Worker> workers_;  ///< a rank; that of the root isn't used
  std::vector<std::string> lost_;
};

}  // namespace nacre::render
