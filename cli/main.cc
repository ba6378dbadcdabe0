// The nacre command. Here errors become exit codes, and nowhere else.

#include "cli/command.h"
#include "core/error.h"

#include <fmt/format.h>
#include <iostream>
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

int RunAndReport(int argc, char** argv) {
  try {
    RequireAddressSpace();
    return RunCommand({argv + 1, argv + argc}, std::cout);
  } catch (const Error& e) {
    std::cerr << "nacre: " << e.what() << '\n';
    return static_cast<int>(e.code());
  } catch (const LogicError& e) {
    std::cerr << "nacre: this is a bug in nacre: " << e.what() << '\n';
    return static_cast<int>(ExitCode::kBug);
  } catch (const std::bad_alloc&) {
    std::cerr << "nacre: out of memory; see whether the verb has a --memory option\n";
    return static_cast<int>(ExitCode::kFailed);
  } catch (const std::exception& e) {
    std::cerr << "nacre: " << e.what() << '\n';
    return static_cast<int>(ExitCode::kFailed);
  }
}

}  // namespace
}  // namespace nacre::cli

int main(int argc, char** argv) {
  return nacre::cli::RunAndReport(argc, argv);
}
