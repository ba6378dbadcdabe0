#pragma once

#include <unistd.h>

namespace nacre {

/// Closes what it holds: a file, socket or pipe, or nothing (-1).
class FileDescriptor {
 public:
  explicit FileDescriptor(int fd) : fd_(fd) {}
  ~FileDescriptor() {
    if (fd_ >= 0) {
      ::close(fd_);
    }
  }
  FileDescriptor(const FileDescriptor&) = delete;
  FileDescriptor& operator=(const FileDescriptor&) = delete;

  int fd() const { return fd_; }

 private:
  int fd_;
};

}  // namespace nacre
