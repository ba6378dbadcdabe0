// nacre report: one self-contained HTML page on a file or a folder.

#include "cli/report/report.h"

#include "cli/command_line.h"
#include "core/atomic_file.h"
#include "core/json.h"

#include <filesystem>
#include <memory>

namespace nacre::cli {
namespace {

struct ReportArguments {
  std::filesystem::path path;
  std::filesystem::path out = "report.html";
};

int Run(const ReportArguments& arguments, const Common& common) {
  const std::string page = report::BuildReport(arguments.path, ConsoleProgress(common));
  WriteFile(arguments.out, page);
  Print(common,
        {{"out", arguments.out.string()}, {"bytes", page.size()}},
        fmt::format("{}: {:.1f} MB",
                    arguments.out.string(),
                    static_cast<double>(page.size()) / 1e6));
  return 0;
}

}  // namespace

std::function<int()> MakeReportVerb(CLI::App& app, const Common& common) {
  auto arguments = std::make_shared<ReportArguments>();
  app.add_option("path", arguments->path, "an artefact, or a folder of artefacts")
      ->required();
  app.add_option("--out", arguments->out, "the page")->capture_default_str();
  return [arguments, &common] { return Run(*arguments, common); };
}

}  // namespace nacre::cli
