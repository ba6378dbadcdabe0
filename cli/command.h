#pragma once

#include <iosfwd>
#include <string>
#include <vector>

namespace nacre {
class Ranks;
}

namespace nacre::cli {

/// Parses and runs one command line, without the program's name: {"factor", "x.rd.exr",
/// …}. Results go to `out`. Returns the exit code of usage errors and --help; anything
/// else that goes wrong is thrown. `ranks`: of one run under mpirun, all of which are
/// given the same line; null: this process alone.
int RunCommand(const std::vector<std::string>& arguments,
               std::ostream& out,
               const Ranks* ranks = nullptr);

}  // namespace nacre::cli
