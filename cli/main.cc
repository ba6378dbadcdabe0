// The nacre command. Here errors become exit codes, and nowhere else.

#include "cli/command.h"
#include "core/error.h"

#include <iostream>
#include <new>

namespace nacre::cli {
namespace {

int RunAndReport(int argc, char** argv) {
  try {
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
