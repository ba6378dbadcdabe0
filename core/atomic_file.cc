#include "core/atomic_file.h"

#include "core/error.h"
#include "core/write_all.h"

#include <array>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <fcntl.h>
#include <fmt/format.h>
#include <system_error>
#include <unistd.h>

namespace nacre {
namespace {

void FlushToDisk(const std::filesystem::path& path, int flags) {
  const int fd = ::open(path.c_str(), flags | O_CLOEXEC);
  if (fd < 0) {
    throw SystemError("cannot open " + path.string() + " to flush it");
  }
  const int result = ::fsync(fd);
  const int error = errno;
  ::close(fd);
  if (result != 0) {
    errno = error;
    throw SystemError("cannot flush " + path.string());
  }
}

std::filesystem::path FolderOf(const std::filesystem::path& path) {
  return path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
}

std::string HostName() {
  std::array<char, 65> name{};
  return ::gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "unknown";
}

// What processes of this machine left behind that were killed while they wrote the same
// file: names that begin and end like this one's, around the number of a process that
// is gone.
void RemoveAbandoned(const std::filesystem::path& folder,
                     const std::string& begin,
                     const std::string& end) {
  std::error_code ignored;  // the names are ours, but maybe not the files
  for (const auto& entry : std::filesystem::directory_iterator(folder, ignored)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(begin) || !name.ends_with(end)) {
      continue;
    }
    pid_t process = 0;
    const char* number = name.data() + begin.size();
    const auto [stop, error] = std::from_chars(number, &name.back(), process);
    const bool is_ours = error == std::errc() && *stop == '.' && process > 0;
    if (is_ours && ::kill(process, 0) != 0 && errno == ESRCH) {
      std::filesystem::remove(entry.path(), ignored);
    }
  }
}

}  // namespace

AtomicFile::AtomicFile(std::filesystem::path path) : path_(std::move(path)) {
  static std::atomic<unsigned> counter{0};
  const std::filesystem::path folder = FolderOf(path_);
  if (!std::filesystem::is_directory(folder)) {
    throw Error(fmt::format(
        "cannot write {}: there is no folder {}", path_.string(), folder.string()));
  }
  const std::string begin = fmt::format(".{}.{}-", path_.stem().string(), HostName());
  const std::string end = ".tmp" + path_.extension().string();
  RemoveAbandoned(folder, begin, end);
  temporary_path_ =
      folder / fmt::format("{}{}.{}{}", begin, ::getpid(), counter++, end);
}

AtomicFile::~AtomicFile() {
  if (!committed_) {
    std::error_code ignored;  // nothing to remove if nothing was written
    std::filesystem::remove(temporary_path_, ignored);
  }
}

void AtomicFile::Commit() {
  FlushToDisk(temporary_path_, O_RDONLY);
  std::error_code error;
  std::filesystem::rename(temporary_path_, path_, error);
  if (error) {
    throw Error(
        fmt::format("cannot rename to {}: {}", path_.string(), error.message()));
  }
  committed_ = true;
  FlushToDisk(FolderOf(path_), O_RDONLY | O_DIRECTORY);
}

void WriteFile(const std::filesystem::path& path, std::string_view bytes) {
  AtomicFile file(path);
  const int fd = ::open(
      file.temporary_path().c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (fd < 0) {
    throw SystemError("cannot write " + path.string());
  }
  if (!WriteAll(fd, bytes)) {
    const int error = errno;
    ::close(fd);
    errno = error;
    throw SystemError("cannot write " + path.string());
  }
  if (::close(fd) != 0) {
    throw SystemError("cannot write " + path.string());
  }
  file.Commit();
}

std::string ReadFile(const std::filesystem::path& path, std::uint64_t max_bytes) {
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) {
    throw SystemError("cannot read " + path.string());
  }
  std::string bytes;
  std::string chunk(1 << 16, '\0');
  for (;;) {
    const ssize_t got = ::read(fd, chunk.data(), chunk.size());
    if (got < 0 && errno == EINTR) {
      continue;
    }
    if (got < 0) {
      const int error = errno;
      ::close(fd);
      errno = error;
      throw SystemError("cannot read " + path.string());
    }
    if (got == 0) {
      break;
    }
    if (bytes.size() + static_cast<std::size_t>(got) > max_bytes) {
      ::close(fd);
      throw BadData(fmt::format(
          "{}: larger than the {} bytes expected at most", path.string(), max_bytes));
    }
    bytes.append(chunk.data(), static_cast<std::size_t>(got));
  }
  ::close(fd);
  return bytes;
}

}  // namespace nacre
