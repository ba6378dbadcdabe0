#pragma once

#include "cli/command_line.h"

#include <vector>

namespace nacre::cli {

struct VerbEntry {
  const char* name;
  const char* summary;
  Verb make;
};

/// The verbs of this build, in the order of `nacre --help`. Generated from
/// cli/CMakeLists.txt, since a module that was left out takes its verbs with it.
const std::vector<VerbEntry>& Verbs();

}  // namespace nacre::cli
