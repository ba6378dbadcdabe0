#include "cli/command.h"

#include "cli/command_line.h"
#include "cli/linked_libraries.h"
#include "cli/verbs.h"
#include "core/error.h"
#include "core/ranks.h"
#include "core/version.h"

#include <algorithm>
#include <ctime>
#include <iostream>
#include <iterator>
#include <span>
#include <string_view>

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

// What each rank but the root would do over again, or do to the same device or file,
// runs in one process alone.
void RequireOneRank(const std::string& verb, const Ranks* ranks) {
  constexpr std::string_view kShared[] = {
      "cluster", "factor", "reconstruct", "render", "simulate"};
  if (ranks == nullptr || ranks->size() == 1 ||
      std::find(std::begin(kShared), std::end(kShared), verb) != std::end(kShared)) {
    return;
  }
  throw UsageError(fmt::format(
      "nacre {} can't share its work among {} ranks: run it without mpirun ({} can)",
      verb,
      ranks->size(),
      fmt::join(kShared, ", ")));
}

// What the ranks cost and told each other, with -v: bench/scaling/scaling.py reads it.
void SayTraffic(const Common& common) {
  if (common.ranks == nullptr || common.ranks->size() == 1) {
    return;
  }
  const RankTraffic traffic = common.ranks->traffic();
  const std::int64_t numbers[] = {
      traffic.bytes_sent,
      traffic.messages_sent,
      traffic.bytes_sent + traffic.bytes_received,
      traffic.messages_sent + traffic.messages_received,
      static_cast<std::int64_t>(1e3 * static_cast<double>(std::clock()) /
                                CLOCKS_PER_SEC)};
  Json json = {{"bytes", 0}, {"messages", 0}};
  for (const std::string& bytes :
       common.ranks->Gather(ToBytes(std::span<const std::int64_t>(numbers)))) {
    const auto of_rank = FromBytes<std::int64_t>(bytes);
    json["bytes"] = json["bytes"].get<std::int64_t>() + of_rank[0];
    json["messages"] = json["messages"].get<std::int64_t>() + of_rank[1];
    json["bytes_by_rank"].push_back(of_rank[2]);
    json["messages_by_rank"].push_back(of_rank[3]);
    json["cpu_seconds_by_rank"].push_back(1e-3 * static_cast<double>(of_rank[4]));
  }
  if (common.verbosity > 1 && common.IsRoot()) {
    Say(common, "ranks: " + json.dump());
  }
}

}  // namespace

int RunCommand(const std::vector<std::string>& arguments,
               std::ostream& out,
               const Ranks* ranks) {
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
  common.ranks = ranks;
  std::function<int()> run;
  for (const VerbEntry& verb : Verbs()) {
    CLI::App* command = app.add_subcommand(verb.name, verb.summary);
    AddCommonOptions(*command, common);
    const std::function<int()> body = verb.make(*command, common);
    command->callback([&run, body, ranks, name = std::string(verb.name)] {
      RequireOneRank(name, ranks);
      run = body;
    });
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
  const int exit_code = run();
  SayTraffic(common);
  return exit_code;
}

}  // namespace nacre::cli
