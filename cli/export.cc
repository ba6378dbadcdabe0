// nacre export: a dataset or a material to other programs' formats.

#include "cli/artefact.h"
#include "cli/command_line.h"
#include "core/error.h"
#include "reconstruct/export/psf.h"
#ifdef NACRE_HAS_FACTOR
#include "cli/exchange/export_maps.h"
#include "factor/factor.h"
#include "factor/sss.h"
#endif

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

int ToPsf(const Arguments& args, const Common& common) {
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

#ifdef NACRE_HAS_FACTOR

// A material of Gaussian profiles as it is; profiles are fitted to a dataset.
int ToSss(const Arguments& args, const Common& common) {
  factor::Material material;
  if (DetectKind(args.file) == ArtefactKind::kMaterial) {
    material = factor::ReadMaterial(args.file);
  } else {
    constexpr int kGaussians = 4;
    reconstruct::RdReader reader(args.file);
    auto fitted = factor::Factor(reader,
                                 {.method = "profiles",
                                  .terms = kGaussians,
                                  .bits = 32,
                                  .thread_count = common.thread_count,
                                  .seed = common.seed},
                                 ConsoleProgress(common));
    Say(common, "fit: " + fitted.summary.Brief());
    material = std::move(fitted.material);
  }
  const std::int64_t bytes = factor::WriteSss(args.out, material);
  Say(common, "lost: pitch, refractive index, what lies beyond the grid");
  Print(
      common,
      Json{
          {"file", args.out.string()}, {"bytes", bytes}, {"gaussians", material.terms}},
      args.out.string());
  return 0;
}

exchange::ProfileFit Fit(const std::filesystem::path& file, const Common& common) {
  const ProgressFunction progress = ConsoleProgress(common);
  if (DetectKind(file) == ArtefactKind::kMaterial) {
    return exchange::FitProfiles(
        factor::ReadMaterial(file), common.thread_count, progress);
  }
  reconstruct::RdReader reader(file);
  return exchange::FitProfiles(reader, common.thread_count, progress);
}

int ToRenderer(const exchange::Target& target,
               const Arguments& args,
               const Common& common) {
  // A preset's folder stands for its material.
  const bool preset = std::filesystem::is_directory(args.file);
  const std::filesystem::path file =
      preset ? args.file / "material.nacre.exr" : args.file;
  const exchange::ProfileFit fit = Fit(file, common);
  const std::string source =
      (preset ? args.file : file).lexically_normal().filename().string();
  Json json = exchange::ExportMaps(target, fit, source, args.out);
  json["out"] = args.out.string();
  Say(common, "fit: " + fit.summary.Brief());
  Say(common, std::string("lost: ") + target.lost);
  Print(common, json, args.out.string() + ": for " + target.program);
  return 0;
}

#endif

int Run(const Arguments& args, const Common& common) {
  if (args.to == "psf") {
    return ToPsf(args, common);
  }
  std::string known = "psf";
#ifdef NACRE_HAS_FACTOR
  if (args.to == "sss") {
    return ToSss(args, common);
  }
  known += ", sss";
  if (const exchange::Target* target = exchange::FindTarget(args.to)) {
    return ToRenderer(*target, args, common);
  }
  for (const exchange::Target& target : exchange::Targets()) {
    known += std::string(", ") + target.name;
  }
#endif
  throw UsageError("--to " + args.to + ": this build writes " + known);
}

}  // namespace

std::function<int()> MakeExportVerb(CLI::App& app, const Common& common) {
  const auto args = std::make_shared<Arguments>();
  app.add_option(
         "file", args->file, "dataset, *.rd.exr; to sss and renderers also *.nacre.exr")
      ->required();
  app.add_option(
         "--to",
         args->to,
         "psf, sss, or a renderer: cycles, pbrt-v4, mtlx, renderman, appleseed, "
         "mitsuba3")
      ->required();
  app.add_option("-o,--out", args->out, "file to write; of renderers a folder")
      ->required();
  AddOptions(app, args->options);
  return [args, &common] { return Run(*args, common); };
}

}  // namespace nacre::cli
