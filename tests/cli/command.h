#pragma once

#include "cli/command.h"
#include "core/json.h"

#include <gtest/gtest.h>

#include <sstream>
#include <string>
#include <vector>

namespace nacre::testing {

/// Runs one quiet command and returns its JSON.
inline Json RunJson(std::vector<std::string> arguments) {
  arguments.insert(arguments.end(), {"--json", "--quiet"});
  std::ostringstream out;
  const int code = cli::RunCommand(arguments, out);
  EXPECT_EQ(code, 0) << out.str();
  return ParseJson(out.str(), arguments.front());
}

}  // namespace nacre::testing
