#include "acquire/read_ahead.h"

#include <algorithm>
#include <fcntl.h>
#include <unistd.h>
#include <utility>

namespace nacre::acquire {

ReadAhead::ReadAhead(const SessionReader& session, std::vector<std::int64_t> numbers)
    : session_(session),
      numbers_(std::move(numbers)),
      thread_([this](const std::stop_token& stop) { Run(stop); }) {}

ReadAhead::~ReadAhead() = default;

void ReadAhead::Allow(std::size_t count) {
  {
    const std::lock_guard lock(mutex_);
    allowed_ = std::max(allowed_, std::min(count, numbers_.size()));
  }
  changed_.notify_one();
}

void ReadAhead::Run(const std::stop_token& stop) {
  for (std::size_t next = 0; next < numbers_.size(); ++next) {
    {
      std::unique_lock lock(mutex_);
      if (!changed_.wait(lock, stop, [&] { return next < allowed_; })) {
        return;
      }
    }
    const std::int64_t number = numbers_[next];
    if (number >= session_.picture_count() || !session_.WasTaken(number)) {
      continue;
    }
    const std::filesystem::path path = session_.folder() / session_.Entry(number).file;
    const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (fd >= 0) {
      ::posix_fadvise(fd, 0, 0, POSIX_FADV_WILLNEED);
      ::close(fd);
    }
  }
}

}  // namespace nacre::acquire
