#include "acquire/session_writer.h"
#include "core/error.h"
#include "core/write_all.h"

#include <cerrno>
#include <fcntl.h>
#include <fmt/format.h>
#include <string>
#include <sys/file.h>
#include <unistd.h>

namespace nacre::acquire {

SessionLock::SessionLock(const std::filesystem::path& folder)
    : fd_(::open((folder / "lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666)) {
  if (fd_ < 0) {
    throw SystemError("cannot open " + (folder / "lock").string());
  }
  if (::flock(fd_, LOCK_EX | LOCK_NB) != 0) {
    const int error = errno;
    std::string holder(16, '\0');
    const ssize_t got = ::pread(fd_, holder.data(), holder.size(), 0);
    holder.resize(got > 0 ? static_cast<std::size_t>(got) : 0);
    ::close(fd_);
    errno = error;
    if (error != EWOULDBLOCK) {
      throw SystemError("cannot lock " + folder.string());
    }
    throw Error(
        fmt::format("{}: process {} is capturing into this session; wait for "
                    "it or stop it",
                    folder.string(),
                    holder.empty() ? "(unknown)" : holder));
  }
  // Only a courtesy to whoever finds it locked; the lock is the flock.
  const std::string process = std::to_string(::getpid());
  if (::ftruncate(fd_, 0) != 0 || !WriteAll(fd_, process)) {
    const Error error = SystemError("cannot write " + (folder / "lock").string());
    ::close(fd_);
    throw error;
  }
}

SessionLock::~SessionLock() {
  ::close(fd_);
}

}  // namespace nacre::acquire
