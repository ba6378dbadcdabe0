#pragma once

#include "acquire/session.h"

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <thread>
#include <vector>

namespace nacre::acquire {

/// Has the system fetch pictures into its cache while others are worked on, so that a
/// disk's time and the processor's don't add up. A thread of its own asks for them, in
/// the order given, and no farther than it was told to. It holds no pictures: a
/// system short of memory may drop them again, and one that can't be fetched is left to
/// whoever reads it.
class ReadAhead {
 public:
  /// `session` must outlive this. Pictures that weren't taken are passed over.
  ReadAhead(const SessionReader& session, std::vector<std::int64_t> numbers);
  ~ReadAhead();
  ReadAhead(const ReadAhead&) = delete;
  ReadAhead& operator=(const ReadAhead&) = delete;

  /// The first `count` of the pictures may be asked for; only ever more of them.
  void Allow(std::size_t count);

 private:
  void Run(const std::stop_token& stop);

  const SessionReader& session_;
  std::vector<std::int64_t> numbers_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::size_t allowed_ = 0;
  std::jthread thread_;  // last: it uses the others
};

}  // namespace nacre::acquire
