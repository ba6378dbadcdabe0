#pragma once

#include <stdexcept>
#include <string>

namespace nacre {

/// Exit codes of the nacre command; the last 64+ ones follow sysexits.h.
enum class ExitCode {
  kDone = 0,
  kFailed = 1,        ///< anything else: disk full, no permission, not converged
  kUsage = 2,         ///< the command line or an option is wrong
  kBadData = 3,       ///< a file is corrupt, truncated, of another kind, or holds NaN
  kDevice = 4,        ///< camera, laser or their connection
  kBug = 70,          ///< an assumption of ours is wrong
  kInterrupted = 75,  ///< stopped on request; `--resume` goes on
};

/// The world is wrong. The message says what was tried, what was found and what to do
/// about it, and starts with `file:line:` for text inputs. Caught once, in main.
class Error : public std::runtime_error {
 public:
  explicit Error(const std::string& message, ExitCode code = ExitCode::kFailed)
      : std::runtime_error(message), code_(code) {}
  ExitCode code() const { return code_; }

 private:
  ExitCode code_;
};

/// Shorthands for the common kinds.
Error UsageError(const std::string& message);
Error BadData(const std::string& message);
Error DeviceError(const std::string& message);
Error Interrupted(const std::string& message);

/// An Error for a failed system call: "<what>: <strerror(errno)>".
Error SystemError(const std::string& what);

/// This program is wrong. Not handled below main.
class LogicError : public std::logic_error {
 public:
  using std::logic_error::logic_error;
};

/// Throws LogicError naming the caller's file and line unless `condition` holds.
void Expect(bool condition,
            const char* what,
            const char* file = __builtin_FILE(),
            int line = __builtin_LINE());

}  // namespace nacre
