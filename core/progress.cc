#include "core/progress.h"

#include "core/error.h"

namespace nacre {

void Report(const ProgressFunction& progress, const Progress& state) {
  if (progress && !progress(state)) {
    throw Interrupted(state.stage + ": stopped on request");
  }
}

}  // namespace nacre
