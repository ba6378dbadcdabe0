#include "cli/command.h"

#include "cli/command_line.h"
#include "cli/linked_libraries.h"
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

}  // namespace

int RunCommand(const std::vector<std::string>& arguments, std::ostream& out) {
  CLI::App app("Nacre captures, factors and renders measured translucency.", "nacre");
  app.footer(
      "Exit codes: 0 done, 1 failed, 2 usage, 3 bad data, 4 device, 70 bug in nacre,\n"
      "75 interrupted and resumable. Data goes to stdout, talk to stderr.");
  bool version = false;
  bool verbose_version = false;
  app.add_flag(
      "--version", version, "print the version; with -v all libraries in use too");
  app.add_flag("-v,--verbose", verbose_version);
  app.require_subcommand(0, 1);

  Common common;
  common.out = &out;
  std::function<int()> run;
  for (const VerbEntry& verb : Verbs()) {
    CLI::App* command = app.add_subcommand(verb.name, verb.summary);
    AddCommonOptions(*command, common);
    const std::function<int()> body = verb.make(*command, common);
    command->callback([&run, body] { run = body; });
  }
  try {
    app.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));
  } catch (const CLI::ParseError& e) {
    return app.exit(e, out, std::cerr) == 0 ? 0 : static_cast<int>(ExitCode::kUsage);
  }
  if (version) {
    out << "nacre " << Version() << '\n' << (verbose_version ? LinkedLibraries() : "");
    return 0;
  }
  if (!run) {
    std::cerr << app.help();
    return static_cast<int>(ExitCode::kUsage);
  }
  return run();
}

}  // namespace nacre::cli
