// nacre run: a project's commands, each only if something it depends on has changed.

#include "cli/command.h"
#include "cli/command_line.h"
#include "cli/project.h"
#include "cli/project_state.h"
#include "cli/remake.h"
#include "cli/stage_clock.h"
#include "core/error.h"

#include <filesystem>
#include <memory>
#include <set>
#include <sstream>

namespace nacre::cli {
namespace {

namespace fs = std::filesystem;

struct RunArguments {
  fs::path project;
  bool dry_run = false;
  bool force = false;
};

/// Words are meant from the project's folder.
class WorkingFolder {
 public:
  explicit WorkingFolder(const fs::path& folder) : before_(fs::current_path()) {
    fs::current_path(folder);
  }
  ~WorkingFolder() {
    std::error_code ignored;  // it may have been removed meanwhile
    fs::current_path(before_, ignored);
  }
  WorkingFolder(const WorkingFolder&) = delete;
  WorkingFolder& operator=(const WorkingFolder&) = delete;

 private:
  fs::path before_;
};

bool Says(const std::vector<std::string>& command, const std::string& option) {
  for (const std::string& word : command) {
    if (word == option || word.starts_with(option + "=")) {
      return true;
    }
  }
  return false;
}

std::vector<std::string> Complete(const ProjectStage& stage,
                                  bool resume,
                                  const Common& common) {
  std::vector<std::string> command = stage.command;
  if (resume && !Says(command, "--resume")) {
    command.emplace_back("--resume");
  }
  if (!Says(command, "--threads")) {
    command.insert(command.end(), {"--threads", std::to_string(common.thread_count)});
  }
  if (!Says(command, "--seed")) {
    command.insert(command.end(), {"--seed", std::to_string(common.seed)});
  }
  command.emplace_back("--json");
  if (common.verbosity == 0) {
    command.emplace_back("--quiet");
  }
  return command;
}

// A stage that reads more than it says would miss a change of that.
void WarnOfUnnamed(const ProjectStage& stage, const Common& common) {
  std::set<std::string> named;
  for (const std::string& path : stage.reads) {
    named.insert(fs::path(path).filename().string());
    if (fs::is_directory(path)) {
      named.insert({"session.json", "journal"});
    }
  }
  for (const std::string& path : stage.writes) {
    std::ostringstream out;
    if (!path.ends_with(".exr") ||
        RunCommand({"inspect", path, "--provenance", "--json", "--quiet"}, out) != 0) {
      continue;
    }
    const Json provenance = ParseJson(out.str(), path);
    const Json inputs = provenance.value("inputs", Json::array());
    for (const Json& input : inputs) {
      const std::string file = input.value("file", "");
      if (!file.empty() && !named.contains(file)) {
        Say(common,
            fmt::format("warning: {} was made from {} too, which stage '{}' doesn't "
                        "name: add it to its `reads`, or a change of it goes unseen",
                        path,
                        file,
                        stage.name));
      }
    }
  }
}

Json RunStage(const ProjectStage& stage,
              const std::string& why,
              ProjectState& state,
              const Common& common) {
  const bool resume = stage.command.front() == "capture" && state.WasInterrupted(stage);
  Say(common, fmt::format("{}: runs, as {}", stage.name, why));
  state.Begin(stage);
  const StageClock clock;
  std::ostringstream result;
  try {
    const int code = RunCommand(Complete(stage, resume, common), result);
    if (code != 0) {
      throw Error("exit code " + std::to_string(code), static_cast<ExitCode>(code));
    }
  } catch (const Error& e) {
    throw Error(fmt::format("stage '{}': {}", stage.name, e.what()), e.code());
  }
  state.End(stage);
  WarnOfUnnamed(stage, common);
  const double seconds = clock.Read().seconds;
  Say(common, fmt::format("{}: {:.1f} s", stage.name, seconds));
  const std::string text = result.str();
  return {{"name", stage.name},
          {"ran", true},
          {"why", why},
          {"seconds", seconds},
          {"result", Json::accept(text) ? Json::parse(text) : Json(text)}};
}

int Run(const RunArguments& args, const Common& common) {
  const std::vector<ProjectStage> stages = ReadProject(args.project);
  const fs::path project = fs::absolute(args.project);
  const WorkingFolder folder(project.parent_path());
  ProjectState state(project);
  const ProgressFunction progress = ConsoleProgress(common);
  Json report = Json::array();
  std::set<std::string> to_be_made;  // what a dry run would write
  std::int64_t ran = 0;
  for (const ProjectStage& stage : stages) {
    if (InterruptRequested()) {
      throw Interrupted("stopped before stage '" + stage.name +
                        "'; the same command goes on");
    }
    std::string why;
    for (const std::string& path : stage.reads) {
      if (to_be_made.contains(path)) {
        why = path;
        why += " will change";
      }
    }
    if (why.empty()) {
      why = state.WhyToRun(stage);
    }
    if (why.empty() && args.force) {
      why = "--force asks for it";
    }
    if (why.empty()) {
      Say(common, stage.name + ": up to date");
      report.push_back({{"name", stage.name}, {"ran", false}});
      continue;
    }
    ++ran;
    if (!args.dry_run) {
      report.push_back(RunStage(stage, why, state, common));
      continue;
    }
    to_be_made.insert(stage.writes.begin(), stage.writes.end());
    std::string line = "nacre";
    for (const std::string& word : stage.command) {
      line += " " + Quoted(word);
    }
    Say(common, fmt::format("{}: would run, as {}: {}", stage.name, why, line));
    report.push_back({{"name", stage.name}, {"ran", false}, {"why", why}});
  }
  Print(common,
        {{"stages", report}},
        fmt::format("{} of {} stages {}",
                    ran,
                    stages.size(),
                    args.dry_run ? "would run" : "ran"));
  return 0;
}

}  // namespace

std::function<int()> MakeRunVerb(CLI::App& app, const Common& common) {
  const auto args = std::make_shared<RunArguments>();
  app.add_option("project", args->project, "TOML with the [[stage]]s of a line")
      ->required();
  app.add_flag("--dry-run", args->dry_run, "say what would run and why");
  app.add_flag("--force", args->force, "run all stages, changed or not");
  app.footer(
      "A stage:\n\n  [[stage]]\n  run = \"factor a.rd.exr --method reciprocal --out "
      "a.nacre.exr\"\n  reads = [\"b\"]   # what the command line doesn't name\n\n"
      "Paths start at the project's folder. What ran with which inputs is kept beside "
      "the project in .NAME.run.json; a capture that was interrupted is resumed.");
  return [args, &common] { return Run(*args, common); };
}

}  // namespace nacre::cli
