#pragma once

#include "acquire/capture.h"
#include "acquire/session_writer.h"

#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <thread>

namespace nacre::acquire::internal {

/// Unpacks, checks and writes frames behind the camera's back, in order, on a thread of
/// its own. Holds at most `capacity` of them: a disk that stays slow slows the capture
/// down instead of filling the memory.
class FrameQueue {
 public:
  FrameQueue(SessionWriter& session, std::size_t capacity, FrameFunction on_frame)
      : session_(session),
        capacity_(capacity),
        on_frame_(std::move(on_frame)),
        thread_([this] { Run(); }) {}

  /// Writes what is queued before it returns.
  ~FrameQueue() { Stop(); }
  FrameQueue(const FrameQueue&) = delete;
  FrameQueue& operator=(const FrameQueue&) = delete;

  /// Throws what the writer threw, if it did.
  void Push(PackedFrame frame) {
    Item item;
    item.frame = std::move(frame);
    Push(std::move(item));
  }

  /// A picture that is left out, and why.
  void PushSkip(const std::string& reason) {
    Item item;
    item.skipped = reason;
    Push(std::move(item));
  }

  /// Returns once all so far is in the session; throws what the writer threw.
  void WaitUntilWritten() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return items_.empty() || error_; });
    RethrowError();
  }

  /// How often the camera had to wait for the disk.
  std::int64_t times_full() const { return times_full_; }

  /// Returns when all is written; throws what the writer threw.
  void Finish() {
    Stop();
    const std::lock_guard lock(mutex_);
    RethrowError();
  }

 private:
  struct Item {
    PackedFrame frame;
    std::string skipped;  // why; empty: a frame
  };

  void Push(Item item) {
    std::unique_lock lock(mutex_);
    times_full_ += items_.size() >= capacity_ && !error_ ? 1 : 0;
    changed_.wait(lock, [this] { return items_.size() < capacity_ || error_; });
    RethrowError();
    items_.push_back(std::move(item));
    changed_.notify_all();
  }

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

  void Write(Item item) {
    const std::int64_t number = session_.picture_count();
    if (!item.skipped.empty()) {
      session_.Skip(item.skipped);
      return;
    }
    const auto frame = std::make_shared<const Frame>(std::move(item.frame).Unpacked());
    item.frame.unpack = {};  // gives the camera its memory back before the disk is busy
    session_.Append(*frame);
    if (on_frame_) {
      on_frame_(number, frame);
    }
  }

  void Run() {
    std::unique_lock lock(mutex_);
    for (;;) {
      changed_.wait(lock, [this] { return !items_.empty() || stopping_; });
      if (items_.empty()) {
        return;
      }
      Item item = std::move(items_.front());
      lock.unlock();
      std::exception_ptr error;
      try {
        Write(std::move(item));
      } catch (...) {
        error = std::current_exception();
      }
      lock.lock();
      items_.pop_front();
      error_ = error;
      changed_.notify_all();
      if (error_) {
        return;
      }
    }
  }

  SessionWriter& session_;
  std::size_t capacity_;
  FrameFunction on_frame_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Item> items_;
  std::int64_t times_full_ = 0;
  bool stopping_ = false;
  std::exception_ptr error_;
  std::thread thread_;  // last: it uses the others
};

}  // namespace nacre::acquire::internal
