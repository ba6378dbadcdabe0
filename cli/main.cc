// The nacre command. Here errors become exit codes, and nowhere else.

#include "cli/command.h"
#include "core/error.h"
#include "core/ranks.h"

#include <chrono>
#include <cstdio>
#include <fmt/format.h>
#include <iostream>
#include <memory>
#include <new>
#include <sys/resource.h>
#include <thread>

namespace nacre::cli {
namespace {

// OpenBLAS takes 128 MB of addresses a core when it first multiplies, and waits for
// ever where it can't have them.
void RequireAddressSpace() {
  constexpr rlim_t kMega = 1'000'000;
  const rlim_t needed = (500 + 135 * std::thread::hardware_concurrency()) * kMega;
  rlimit limit{};
  if (::getrlimit(RLIMIT_AS, &limit) == 0 && limit.rlim_cur < needed) {
    throw Error(fmt::format(
        "cannot work in {} MB of address space, {} MB are needed here: raise "
        "the limit (ulimit -v), or use --memory to bound what is held",
        limit.rlim_cur / kMega,
        needed / kMega));
  }
}

// Where everybody would say the same, the root says it: standard output and talk of the
// other ranks go nowhere.
void Silence() {
  std::cout.rdbuf(nullptr);
  std::cerr.rdbuf(nullptr);
}

// One rank's failure is that of all: its message, then the end of every process. What
// several find out at a time is left to the root to say, whose end takes a second or
// two to reach the others.
int Fail(const Ranks* ranks, const std::string& message, ExitCode code) {
  const auto exit_code = static_cast<int>(code);
  if (ranks == nullptr || ranks->size() == 1) {
    std::cerr << "nacre: " << message << '\n';
    return exit_code;
  }
  if (!ranks->IsRoot()) {
    std::this_thread::sleep_for(std::chrono::seconds(3));
  }
  const std::string line = fmt::format("nacre: rank {}: {}\n", ranks->rank(), message);
  std::fputs(line.c_str(), stderr);
  ranks->Abort(exit_code);
  return exit_code;
}

int RunAndReport(int argc, char** argv) {
  std::unique_ptr<Ranks> ranks;
  try {
    RequireAddressSpace();
    ranks = JoinRanks();
    if (!ranks->IsRoot()) {
      Silence();
    }
    return RunCommand({argv + 1, argv + argc}, std::cout, ranks.get());
  } catch (const Error& e) {
    return Fail(ranks.get(), e.what(), e.code());
  } catch (const LogicError& e) {
    return Fail(ranks.get(),
                fmt::format("this is a bug in nacre: {}", e.what()),
                ExitCode::kBug);
  } catch (const std::bad_alloc&) {
    return Fail(ranks.get(),
                "out of memory; see whether the verb has a --memory option",
                ExitCode::kFailed);
  } catch (const std::exception& e) {
    return Fail(ranks.get(), e.what(), ExitCode::kFailed);
  }
}

}  // namespace
}  // namespace nacre::cli

int main(int argc, char** argv) {
  return nacre::cli::RunAndReport(argc, argv);
}
