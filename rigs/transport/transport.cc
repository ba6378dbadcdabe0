#include "rigs/transport/transport.h"

#include "core/error.h"
#include "rigs/transport/path_averaged.h"

#include <fmt/format.h>

namespace nacre::rigs {

Solver ParseSolver(const std::string& name) {
  if (name == "auto") {
    return Solver::kAuto;
  }
  if (name == "fast") {
    return Solver::kFast;
  }
  throw UsageError(fmt::format(
      "--solver {}: this build has no such solver; it has: fast, auto (which is fast)",
      name));
}

std::unique_ptr<Transport> MakeTransport(const Phantom& phantom,
                                         Solver /*all are the same today*/,
                                         int thread_count) {
  return std::make_unique<PathAveraged>(phantom, thread_count);
}

}  // namespace nacre::rigs
