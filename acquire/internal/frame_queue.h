#pragma once

#include "acquire/session_writer.h"

#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <thread>

namespace nacre::acquire::internal {

/// Writes frames behind the camera's back, in order, on a thread of its own. Holds at
/// most `capacity` of them: a slow disk slows the capture down instead of filling the
/// memory.
class FrameQueue {
 public:
  FrameQueue(SessionWriter& session, std::size_t capacity)
      : session_(session), capacity_(capacity), thread_([this] { Run(); }) {}

  /// Writes what is queued before it returns.
  ~FrameQueue() { Stop(); }
  FrameQueue(const FrameQueue&) = delete;
  FrameQueue& operator=(const FrameQueue&) = delete;

  /// Throws what the writer threw, if it did.
  void Push(Frame frame) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return frames_.size() < capacity_ || error_; });
    RethrowError();
    frames_.push_back(std::move(frame));
    changed_.notify_all();
  }

  /// Returns when all is written; throws what the writer threw.
  void Finish() {
    Stop();
    const std::lock_guard lock(mutex_);
    RethrowError();
  }

 private:
  void RethrowError() {
    if (error_) {
      std::rethrow_exception(error_);
    }
  }

  void Stop() {
    {
      const std::lock_guard lock(mutex_);
      stopping_ = true;
      changed_.notify_all();
    }
    if (thread_.joinable()) {
      thread_.join();
    }
  }

  void Run() {
    std::unique_lock lock(mutex_);
    for (;;) {
      changed_.wait(lock, [this] { return !frames_.empty() || stopping_; });
      if (frames_.empty()) {
        return;
      }
      const Frame frame = std::move(frames_.front());
      lock.unlock();
      std::exception_ptr error;
      try {
        session_.Append(frame);
      } catch (...) {
        error = std::current_exception();
      }
      lock.lock();
      frames_.pop_front();
      error_ = error;
      changed_.notify_all();
      if (error_) {
        return;
      }
    }
  }

  SessionWriter& session_;
  std::size_t capacity_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Frame> frames_;
  bool stopping_ = false;
  std::exception_ptr error_;
  std::thread thread_;  // last: it uses the others
};

}  // namespace nacre::acquire::internal
