// Preloaded into the nacre command: the system calls that move files' bytes fail, do
// half of what they were asked for, or are the last thing that the process does.
//
// NACRE_FAULT = CALLS:NUMBER:KIND[:AGAIN]
//   CALLS   read, write, sync, rename, open (for writing), mkdir, map, clock, memory
//           (of 32 kB and more at once)
//   NUMBER  of the call that is hit, from 1; 0: none, calls are only counted
//   KIND    an errno's name, "half", "kill" (SIGKILL before the call), "term" (SIGTERM)
//   AGAIN   "on": every later one too, as on a full disk; for clock, each call jumps
// NACRE_FAULT_COUNT names a file that gets the number of calls when the process ends.
// Only calls on regular files below NACRE_FAULT_FOLDER count (open, rename: paths).

#include <atomic>
#include <cerrno>
#include <climits>
#include <csignal>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <dlfcn.h>
#include <fcntl.h>
#include <string>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <unistd.h>

namespace {

struct Fault {
  std::string calls;
  long number = 0;
  std::string kind;
  bool goes_on = false;
  std::string folder;
  std::atomic<long> count{0};
};

int ErrnoOf(const std::string& name) {
  static const struct {
    const char* name;
    int value;
  } names[] = {{"EIO", EIO},
               {"ENOSPC", ENOSPC},
               {"EINTR", EINTR},
               {"EACCES", EACCES},
               {"EROFS", EROFS},
               {"EMFILE", EMFILE},
               {"EDQUOT", EDQUOT},
               {"ENOMEM", ENOMEM}};
  for (const auto& known : names) {
    if (name == known.name) {
      return known.value;
    }
  }
  return EIO;
}

std::string Part(const std::string& text, int index) {
  std::size_t begin = 0;
  for (int k = 0; k < index && begin != std::string::npos; ++k) {
    begin = text.find(':', begin);
    begin = begin == std::string::npos ? begin : begin + 1;
  }
  return begin == std::string::npos ? ""
                                    : text.substr(begin, text.find(':', begin) - begin);
}

Fault& TheFault() {
  static Fault& fault = *[] {
    auto* made = new Fault;  // calls come until the very end of the process
    const char* text = std::getenv("NACRE_FAULT");
    const std::string words = text == nullptr ? "" : text;
    made->calls = Part(words, 0);
    made->number = std::atol(Part(words, 1).c_str());
    made->kind = Part(words, 2);
    made->goes_on = Part(words, 3) == "on";
    const char* folder = std::getenv("NACRE_FAULT_FOLDER");
    made->folder = folder == nullptr ? "/" : folder;
    return made;
  }();
  return fault;
}

template <class Function>
Function Real(Function, const char* name) {
  return reinterpret_cast<Function>(::dlsym(RTLD_NEXT, name));
}

enum class Now { kGoOn, kFail, kHalf };

// Counts one call of that kind; errno is set if it is to fail.
Now Hit(const char* calls) {
  Fault& fault = TheFault();
  if (fault.calls != calls) {
    return Now::kGoOn;
  }
  const long n = ++fault.count;
  if (fault.number == 0 || n < fault.number || (n > fault.number && !fault.goes_on)) {
    return Now::kGoOn;
  }
  if (fault.kind == "kill") {
    ::kill(::getpid(), SIGKILL);
    ::pause();
  }
  if (fault.kind == "term") {
    ::kill(::getpid(), SIGTERM);
    return Now::kGoOn;
  }
  if (fault.kind == "half") {
    return Now::kHalf;
  }
  errno = ErrnoOf(fault.kind);
  return Now::kFail;
}

bool IsOurs(const char* path) {
  char full[PATH_MAX];
  const std::string text = path;
  const std::size_t slash = text.rfind('/');
  const std::string folder =
      slash == std::string::npos ? "." : text.substr(0, slash + 1);
  return ::realpath(folder.c_str(), full) != nullptr &&
         std::string(full).starts_with(TheFault().folder);
}

bool IsOurs(int fd) {
  struct stat status {};
  if (::fstat(fd, &status) != 0 ||
      !(S_ISREG(status.st_mode) || S_ISDIR(status.st_mode))) {
    return false;
  }
  char full[PATH_MAX];
  const std::string link = "/proc/self/fd/" + std::to_string(fd);
  const ssize_t size = ::readlink(link.c_str(), full, sizeof(full));
  return size > 0 && std::string(full, static_cast<std::size_t>(size))
                         .starts_with(TheFault().folder);
}

std::size_t Size(Now now, std::size_t size) {
  return now == Now::kHalf ? (size + 1) / 2 : size;
}

mode_t ModeOf(int flags, va_list arguments) {
  return (flags & O_CREAT) != 0 ? va_arg(arguments, mode_t) : 0;
}

bool Writes(int flags) {
  return (flags & O_ACCMODE) != O_RDONLY;
}

struct CountWriter {
  ~CountWriter() {
    const char* path = std::getenv("NACRE_FAULT_COUNT");
    if (path == nullptr) {
      return;
    }
    const long count = TheFault().count;
    if (std::FILE* file = std::fopen(path, "w")) {
      std::fprintf(file, "%ld\n", count);
      std::fclose(file);
    }
  }
} count_writer;

}  // namespace

extern "C" {

ssize_t write(int fd, const void* data, size_t size) {
  static const auto real = Real(&write, "write");
  const Now now = IsOurs(fd) ? Hit("write") : Now::kGoOn;
  return now == Now::kFail ? -1 : real(fd, data, Size(now, size));
}

ssize_t pwrite(int fd, const void* data, size_t size, off_t offset) {
  static const auto real = Real(&pwrite, "pwrite");
  const Now now = IsOurs(fd) ? Hit("write") : Now::kGoOn;
  return now == Now::kFail ? -1 : real(fd, data, Size(now, size), offset);
}

ssize_t pwrite64(int fd, const void* data, size_t size, off64_t offset) {
  return pwrite(fd, data, size, offset);
}

ssize_t writev(int fd, const struct iovec* pieces, int count) {
  static const auto real = Real(&writev, "writev");
  const Now now = IsOurs(fd) ? Hit("write") : Now::kGoOn;
  if (now == Now::kHalf) {
    for (int k = 0; k < count; ++k) {
      if (pieces[k].iov_len > 0) {
        return ::write(fd, pieces[k].iov_base, (pieces[k].iov_len + 1) / 2);
      }
    }
  }
  return now == Now::kFail ? -1 : real(fd, pieces, count);
}

ssize_t read(int fd, void* data, size_t size) {
  static const auto real = Real(&read, "read");
  const Now now = IsOurs(fd) ? Hit("read") : Now::kGoOn;
  return now == Now::kFail ? -1 : real(fd, data, Size(now, size));
}

ssize_t pread(int fd, void* data, size_t size, off_t offset) {
  static const auto real = Real(&pread, "pread");
  const Now now = IsOurs(fd) ? Hit("read") : Now::kGoOn;
  return now == Now::kFail ? -1 : real(fd, data, Size(now, size), offset);
}

ssize_t pread64(int fd, void* data, size_t size, off64_t offset) {
  return pread(fd, data, size, offset);
}

int fsync(int fd) {
  static const auto real = Real(&fsync, "fsync");
  return IsOurs(fd) && Hit("sync") == Now::kFail ? -1 : real(fd);
}

int fdatasync(int fd) {
  static const auto real = Real(&fdatasync, "fdatasync");
  return IsOurs(fd) && Hit("sync") == Now::kFail ? -1 : real(fd);
}

int rename(const char* from, const char* to) {
  static const auto real = Real(&rename, "rename");
  return IsOurs(to) && Hit("rename") == Now::kFail ? -1 : real(from, to);
}

int mkdir(const char* path, mode_t mode) {
  static const auto real = Real(&mkdir, "mkdir");
  return IsOurs(path) && Hit("mkdir") == Now::kFail ? -1 : real(path, mode);
}

void* mmap(
    void* address, size_t size, int protection, int flags, int fd, off_t offset) {
  static const auto real = Real(&mmap, "mmap");
  const bool of_file = fd >= 0 && IsOurs(fd);
  return of_file && Hit("map") == Now::kFail
             ? MAP_FAILED
             : real(address, size, protection, flags, fd, offset);
}

void* mmap64(
    void* address, size_t size, int protection, int flags, int fd, off_t offset) {
  return mmap(address, size, protection, flags, fd, offset);
}

int open(const char* path, int flags, ...) {
  static const auto real = Real(&open, "open");
  va_list arguments;
  va_start(arguments, flags);
  const mode_t mode = ModeOf(flags, arguments);
  va_end(arguments);
  const bool fails = Writes(flags) && IsOurs(path) && Hit("open") == Now::kFail;
  return fails ? -1 : real(path, flags, mode);
}

int open64(const char* path, int flags, ...) {
  va_list arguments;
  va_start(arguments, flags);
  const mode_t mode = ModeOf(flags, arguments);
  va_end(arguments);
  return open(path, flags, mode);
}

FILE* fopen64(const char* path, const char* mode) {
  static const auto real = Real(&fopen64, "fopen64");
  const bool fails =
      std::strpbrk(mode, "wa+") != nullptr && IsOurs(path) && Hit("open") == Now::kFail;
  return fails ? nullptr : real(path, mode);
}

FILE* fopen(const char* path, const char* mode) {
  static const auto real = Real(&fopen, "fopen");
  const bool fails =
      std::strpbrk(mode, "wa+") != nullptr && IsOurs(path) && Hit("open") == Now::kFail;
  return fails ? nullptr : real(path, mode);
}

// NOLINTBEGIN(bugprone-reserved-identifier,readability-identifier-naming): libc
void* __libc_malloc(size_t);
void* __libc_calloc(size_t, size_t);
void* __libc_realloc(void*, size_t);
void* __libc_memalign(size_t, size_t);

// Small pieces are asked for before and while all of this is set up.
bool MemoryFails(size_t size) {
  constexpr size_t kLarge = 32768;
  return size >= kLarge && Hit("memory") == Now::kFail;
}

void* malloc(size_t size) {
  return MemoryFails(size) ? nullptr : __libc_malloc(size);
}

void* calloc(size_t count, size_t size) {
  return size != 0 && MemoryFails(count * size) ? nullptr : __libc_calloc(count, size);
}

void* realloc(void* old, size_t size) {
  return MemoryFails(size) ? nullptr : __libc_realloc(old, size);
}

void* memalign(size_t alignment, size_t size) {
  return MemoryFails(size) ? nullptr : __libc_memalign(alignment, size);
}
// NOLINTEND(bugprone-reserved-identifier,readability-identifier-naming)

void* aligned_alloc(size_t alignment, size_t size) {
  return memalign(alignment, size);
}

int posix_memalign(void** result, size_t alignment, size_t size) {
  *result = memalign(alignment, size);
  return *result == nullptr ? ENOMEM : 0;
}

int clock_gettime(clockid_t id, struct timespec* time) {
  static const auto real = Real(&clock_gettime, "clock_gettime");
  const int result = real(id, time);
  if (id == CLOCK_REALTIME && TheFault().calls == "clock") {
    const long n = ++TheFault().count;
    constexpr long kDay = 86400;
    time->tv_sec += (n % 3 - 1) * kDay * (n % 400);  // to and fro, up to a year
  }
  return result;
}

}  // extern "C"
