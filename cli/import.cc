// nacre import: archived scans to a dataset.

#include "cli/command_line.h"
#include "core/error.h"
#include "factor/sss.h"
#include "reconstruct/import/images.h"
#include "reconstruct/import/npy.h"
#include "reconstruct/import/psf.h"
#ifdef NACRE_HAS_MAT
#include "reconstruct/import/mat.h"
#endif

#include <filesystem>
#include <memory>

namespace nacre::cli {
namespace {

using reconstruct::ImageImportOptions;
using reconstruct::ImportOptions;
using reconstruct::ImportSummary;

struct ImportArguments {
  std::filesystem::path file;
  std::string from;
  std::filesystem::path out;
  ImportOptions options;
  ImageImportOptions images;
  reconstruct::ArrayImportOptions arrays;
};

// Profiles are a material already; as a dataset they are sampled.
ImportSummary ImportSss(const ImportArguments& args, const ProgressFunction& progress) {
  const factor::Material m = factor::ReadSss(args.file,
                                             {.pitch_mm = args.options.pitch_mm,
                                              .eta = args.options.eta,
                                              .scale = args.options.scale});
  ImportSummary summary{.points_x = m.points_x,
                        .points_y = m.points_y,
                        .core = m.core,
                        .channel_count = static_cast<int>(m.channels.size())};
  if (args.out.filename().string().ends_with(".nacre.exr")) {
    factor::WriteMaterial(args.out, m);
  } else {
    summary.invalid_count = factor::WriteSlices(args.out, m, progress);
  }
  return summary;
}

ImportSummary RunImport(const ImportArguments& args, const Common& common) {
  const ProgressFunction progress = ConsoleProgress(common);
  if (args.from == "psf") {
    return reconstruct::ImportPsf(args.file, args.out, args.options, progress);
  }
  if (args.from == "images") {
    return reconstruct::ImportImages(
        args.file, args.out, args.options, args.images, progress);
  }
  if (args.from == "npy") {
    return reconstruct::ImportNpy(
        args.file, args.out, args.options, args.arrays, progress);
  }
  if (args.from == "mat") {
#ifdef NACRE_HAS_MAT
    return reconstruct::ImportMat(
        args.file, args.out, args.options, args.arrays, progress);
#else
    throw UsageError(
        "--from mat: this build has no libmatio; install it and build again");
#endif
  }
  if (args.from == "sss") {
    return ImportSss(args, progress);
  }
  throw UsageError("--from " + args.from +
                   ": not one of psf, sss, images, npy and mat");
}

int Run(const ImportArguments& args, const Common& common) {
  if (!(args.options.pitch_mm > 0)) {
    throw UsageError("--pitch-mm must be more than 0");
  }
  const ImportSummary summary = RunImport(args, common);
  Say(common, "imported " + args.file.string() + ": " + summary.Brief());
  Print(common,
        Json{{"file", args.out.string()},
             {"points", {summary.points_x, summary.points_y}},
             {"core", summary.core},
             {"channels", summary.channel_count},
             {"clamped", summary.clamped_count},
             {"invalid", summary.invalid_count}},
        args.out.string());
  return 0;
}

}  // namespace

std::function<int()> MakeImportVerb(CLI::App& app, const Common& common) {
  const auto args = std::make_shared<ImportArguments>();
  app.add_option("file", args->file, "the file; of images, the folder")->required();
  app.add_option("--from", args->from, "psf, sss, images, npy or mat")->required();
  app.add_option(
         "-o,--out", args->out, "dataset to write, *.rd.exr; of sss also *.nacre.exr")
      ->required();
  AddOptions(app, args->options);
  app.get_option("--pitch-mm")->required();
  AddOptions(app, args->images);
  AddOptions(app, args->arrays);
  return [args, &common] { return Run(*args, common); };
}

}  // namespace nacre::cli
