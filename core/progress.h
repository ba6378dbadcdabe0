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

}  // namespace nacre
