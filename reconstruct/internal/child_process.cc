#include "reconstruct/internal/child_process.h"

#include "core/error.h"
#include "core/file_descriptor.h"
#include "core/write_all.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <fmt/format.h>
#include <new>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace nacre::reconstruct::internal {
namespace {

// What a child of ours may end with; a library, or a sanitizer, may end it otherwise.
constexpr std::array kKnown = {ExitCode::kFailed,
                               ExitCode::kUsage,
                               ExitCode::kBadData,
                               ExitCode::kBug,
                               ExitCode::kInterrupted};

// Handlers of the parent's (interruption, sanitizers) have nothing to say here, and a
// crash is expected: no core of it.
void PrepareChild(int most_seconds) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  const rlimit none{0, 0};
  ::setrlimit(RLIMIT_CORE, &none);
  const auto seconds = static_cast<rlim_t>(most_seconds);
  const rlimit time{seconds, seconds + 1};  // asked to end, then made to
  ::setrlimit(RLIMIT_CPU, &time);
  for (const int signal :
       {SIGINT, SIGTERM, SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGXCPU}) {
    std::signal(signal, SIG_DFL);
  }
}

ExitCode Leave(int fd, const char* message, ExitCode code) {
  const bool is_told =
      ::ftruncate(fd, 0) == 0 && ::lseek(fd, 0, SEEK_SET) == 0 && WriteAll(fd, message);
  return is_told ? code : ExitCode::kFailed;
}

ExitCode Work(int fd, const std::function<void(int fd)>& work) {
  try {
    work(fd);
    return ExitCode::kDone;
  } catch (const Error& e) {
    return Leave(fd, e.what(), e.code());
  } catch (const std::bad_alloc&) {
    return Leave(fd, "there isn't enough memory", ExitCode::kFailed);
  } catch (const std::exception& e) {
    return Leave(fd, e.what(), ExitCode::kBug);
  }
}

int WaitFor(pid_t child) {
  int status = 0;
  while (::waitpid(child, &status, 0) < 0) {
    if (errno != EINTR) {
      throw SystemError("cannot wait for a child process");
    }
  }
  return status;
}

std::string TextOf(const std::filesystem::path& path) {
  const MappedFile file(path);
  return {file.bytes().begin(), file.bytes().end()};
}

}  // namespace

std::unique_ptr<MappedFile> RunInChild(const std::string& origin,
                                       int most_seconds,
                                       const std::function<void(int fd)>& work) {
  const FileDescriptor result(::memfd_create("nacre", MFD_CLOEXEC));
  if (result.fd() < 0) {
    throw SystemError(origin + ": cannot make a file in memory");
  }
  const pid_t child = ::fork();
  if (child < 0) {
    throw SystemError(origin + ": cannot start a process to read it");
  }
  if (child == 0) {
    PrepareChild(most_seconds);
    ::_exit(static_cast<int>(Work(result.fd(), work)));
  }
  const int status = WaitFor(child);
  const std::filesystem::path path = fmt::format("/proc/self/fd/{}", result.fd());
  if (WIFEXITED(status)) {
    const auto code = static_cast<ExitCode>(WEXITSTATUS(status));
    if (code == ExitCode::kDone) {
      return std::make_unique<MappedFile>(path);
    }
    if (std::ranges::find(kKnown, code) == kKnown.end()) {
      throw BadData(
          fmt::format("{}: the library that reads it ended its process (exit code "
                      "{}): damaged, or made to do that",
                      origin,
                      WEXITSTATUS(status)));
    }
    throw Error(TextOf(path), code);
  }
  switch (const int signal = WTERMSIG(status)) {
    case SIGINT:
    case SIGTERM:
      throw Interrupted(origin + ": stopped on request");
    case SIGXCPU:
      throw BadData(
          fmt::format("{}: isn't read after {} s: damaged, or made to take long",
                      origin,
                      most_seconds));
    case SIGKILL:
      throw Error(origin +
                  ": the process that read it was killed, maybe for want of "
                  "memory");
    default:
      throw BadData(
          fmt::format("{}: the library that reads it died of it ({}): damaged, "
                      "or made to do that",
                      origin,
                      ::strsignal(signal)));
  }
}

}  // namespace nacre::reconstruct::internal
