#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace nacre::cli {

/// One thing found out about the machine.
struct Finding {
  enum class State {
    kGood,
    kNote,     ///< works, could be better, or isn't there and may not be needed
    kProblem,  ///< something that nacre does won't work
  };
  std::string area;  ///< "processor", "network", …
  std::string name;
  std::string value;
  State state = State::kGood;
  std::string advice;  ///< what to do; empty where nothing
};

const char* Name(Finding::State state);

/// Processor, memory, disk space in `folder`, network interfaces and USB devices, from
/// /proc and /sys below `root` ("/" but in tests). What the system doesn't tell is a
/// finding too; nothing is thrown.
std::vector<Finding> CheckMachine(const std::filesystem::path& root,
                                  const std::filesystem::path& folder);

}  // namespace nacre::cli
