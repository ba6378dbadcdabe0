#include "core/error.h"

#include <cerrno>
#include <fmt/format.h>
#include <system_error>

namespace nacre {

Error UsageError(const std::string& message) {
  return Error(message, ExitCode::kUsage);
}
Error BadData(const std::string& message) {
  return Error(message, ExitCode::kBadData);
}
Error DeviceError(const std::string& message) {
  return Error(message, ExitCode::kDevice);
}
Error Interrupted(const std::string& message) {
  return Error(message, ExitCode::kInterrupted);
}

Error SystemError(const std::string& what) {
  return Error(fmt::format("{}: {}", what, std::generic_category().message(errno)));
}

void Expect(bool condition, const char* what, const char* file, int line) {
  if (!condition) {
    throw LogicError(fmt::format("{}:{}: expected {}", file, line, what));
  }
}

}  // namespace nacre
