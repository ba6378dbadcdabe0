#pragma once

#include <cstdint>
#include <functional>
#include <string>

namespace nacre {

struct Progress {
  std::string stage;      ///< "capture", "factor", …
  std::int64_t done = 0;  ///< units finished
  std::int64_t total = 0;
  std::string note;  ///< may be empty
};

/// Called from one thread at a time; returns false to ask the work to stop, which then
/// ends with an Interrupted error (or a resumable state where the stage has one).
using ProgressFunction = std::function<bool(const Progress&)>;

/// Reports and throws Interrupted if the answer is to stop. An empty function is fine.
void Report(const ProgressFunction& progress, const Progress& state);

/// For work in `part_count` equal parts, each of which reports its own progress: that
/// of part number `part`, seen as progress of the whole. Empty if `progress` is. It
/// refers to `progress`, which has to outlive it.
ProgressFunction PartOf(const ProgressFunction& progress,
                        std::int64_t part,
                        std::int64_t part_count);

}  // namespace nacre
