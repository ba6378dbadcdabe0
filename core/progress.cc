#include "core/progress.h"

#include "core/error.h"

namespace nacre {

void Report(const ProgressFunction& progress, const Progress& state) {
  if (progress && !progress(state)) {
    throw Interrupted(state.stage + ": stopped on request");
  }
}

ProgressFunction PartOf(const ProgressFunction& progress,
                        std::int64_t part,
                        std::int64_t part_count) {
  if (!progress) {
    return {};
  }
  return [&progress, part, part_count](const Progress& state) {
    return progress({state.stage,
                     part * state.total + state.done,
                     part_count * state.total,
                     state.note});
  };
}

}  // namespace nacre
