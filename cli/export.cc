// nacre export: a dataset to other programs' formats.

#include "cli/command_line.h"
#include "core/error.h"
#include "reconstruct/export/psf.h"

#include <filesystem>
#include <memory>

namespace nacre::cli {
namespace {

struct Arguments {
  std::filesystem::path file;
  std::string to;
  std::filesystem::path out;
  reconstruct::ExportOptions options;
};

int Run(const Arguments& args, const Common& common) {
  if (args.to != "psf") {
    throw UsageError("--to " + args.to + ": not in this version, which writes psf");
  }
  const reconstruct::ExportSummary summary = reconstruct::ExportPsf(
      args.file, args.out, args.options, ConsoleProgress(common));
  Say(common, "exported " + args.file.string() + ": " + summary.Brief());
  Print(common,
        Json{{"file", args.out.string()},
             {"bytes", summary.bytes},
             {"clamped", summary.clamped_count},
             {"invalid", summary.invalid_count}},
        args.out.string());
  return 0;
}

}  // namespace

std::function<int()> MakeExportVerb(CLI::App& app, const Common& common) {
  const auto args = std::make_shared<Arguments>();
  app.add_option("file", args->file, "dataset, *.rd.exr")->required();
  app.add_option("--to", args->to, "psf")->required();
  app.add_option("-o,--out", args->out, "file to write")->required();
  AddOptions(app, args->options);
  return [args, &common] { return Run(*args, common); };
}

}  // namespace nacre::cli
