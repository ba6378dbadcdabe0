// nacre VERB …: one verb a stage, one file a verb. Here: the table of verbs, the
// options they share, and the one place where errors become exit codes.

#include "cli/command_line.h"
#include "cli/verbs.h"
#include "core/error.h"
#include "core/version.h"

#include <iostream>

namespace nacre::cli {
namespace {

void AddCommonOptions(CLI::App& app, Common& common) {
  app.add_flag(
      "--json", common.json, "print one JSON object on stdout and nothing else there");
  app.add_flag_callback(
      "-q,--quiet", [&] { common.verbosity = 0; }, "say nothing on stderr but errors");
  app.add_flag_function(
      "-v,--verbose",
      [&](std::int64_t count) { common.verbosity = 1 + static_cast<int>(count); },
      "say more; may be repeated");
  app.add_option("--threads", common.thread_count, "number of threads; 0: all cores")
      ->capture_default_str()
      ->check(CLI::Range(0, 4096));
  app.add_option("--seed", common.seed, "seed of everything random")
      ->capture_default_str();
}

int Run(int argc, char** argv) {
  CLI::App app("Nacre captures, factors and renders measured translucency.", "nacre");
  app.footer(
      "Exit codes: 0 done, 1 failed, 2 usage, 3 bad data, 4 device, 70 bug in nacre,\n"
      "75 interrupted and resumable. Data goes to stdout, talk to stderr.");
  bool long_version = false;
  bool version = false;
  app.add_flag(
      "--version", version, "print the version; with -v that of the libraries too");
  app.add_flag("-v,--verbose", long_version);
  app.require_subcommand(0, 1);

  Common common;
  std::function<int()> run;
  for (const VerbEntry& verb : Verbs()) {
    CLI::App* command = app.add_subcommand(verb.name, verb.summary);
    AddCommonOptions(*command, common);
    const std::function<int()> body = verb.make(*command, common);
    command->callback([&run, body] { run = body; });
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : static_cast<int>(ExitCode::kUsage);
  }
  if (version) {
    std::cout << "nacre " << Version() << '\n'
              << (long_version ? LibraryVersions() : "");
    return 0;
  }
  if (!run) {
    std::cerr << app.help();
    return static_cast<int>(ExitCode::kUsage);
  }
  return run();
}

int RunAndReport(int argc, char** argv) {
  try {
    return Run(argc, argv);
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
