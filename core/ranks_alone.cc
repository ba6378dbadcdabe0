// Ranks of a build without MPI.

#include "core/error.h"
#include "core/ranks.h"

#include <fmt/format.h>

namespace nacre {

std::unique_ptr<Ranks> JoinRanks() {
  const std::optional<LaunchedAs> launched = FindLauncher();
  if (launched && launched->size > 1) {
    throw UsageError(fmt::format(
        "started as one of {} processes, but this build can't share work among them: "
        "build with -DNACRE_WITH_MPI=ON, or run it without mpirun",
        launched->size));
  }
  return std::make_unique<Ranks>();
}

}  // namespace nacre
