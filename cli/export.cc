// nacre export: a dataset or a material to other programs' formats.

#include "cli/artefact.h"
#include "cli/command_line.h"
#include "cli/exchange/export_maps.h"
#include "core/error.h"
#include "factor/sss.h"
#include "reconstruct/export/psf.h"
#ifdef NACRE_HAS_FACTOR
#include "factor/factor.h"
#endif
#ifdef NACRE_HAS_PRESETS
#include "cli/preset/preset.h"
#endif

#include <filesystem>
#include <memory>

namespace nacre::cli {
namespace {

struct ExportArguments {
  std::filesystem::path file;
  std::string name;  ///< of the file, or of the preset that it belongs to
  std::string to;
  std::filesystem::path out;
  reconstruct::ExportOptions options;
};

int ToPsf(const ExportArguments& args, const Common& common) {
  if (DetectKind(args.file) == ArtefactKind::kMaterial) {
    throw UsageError(
        fmt::format("--to psf takes a dataset; 'nacre edit {} --out "
                    "x.rd.exr' makes one of a material",
                    args.name));
  }
  const reconstruct::ExportSummary summary = reconstruct::ExportPsf(
      args.file, args.out, args.options, ConsoleProgress(common));
  constexpr const char* kLost =
      "pitch, refractive index, names of channels, noise, which values are valid";
  Say(common, "exported " + args.file.string() + ": " + summary.Brief());
  Say(common, std::string("lost: ") + kLost);
  Print(common,
        Json{{"file", args.out.string()},
             {"bytes", summary.bytes},
             {"clamped", summary.clamped_count},
             {"invalid", summary.invalid_count},
             {"unit", "R_d in mm^-2, means over cells"},
             {"residual", 0},
             {"lost", kLost}},
        args.out.string());
  return 0;
}

factor::Material FitProfiles(const ExportArguments& args, const Common& common) {
#ifdef NACRE_HAS_FACTOR
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
  return std::move(fitted.material);
#else
  throw UsageError(args.file.string() +
                   ": is a dataset; this build was made without `factor`, which would "
                   "fit profiles to it");
#endif
}

// A material of Gaussian profiles as it is; profiles are fitted to a dataset.
int ToSss(const ExportArguments& args, const Common& common) {
  const factor::Material material = DetectKind(args.file) == ArtefactKind::kMaterial
                                        ? factor::ReadMaterial(args.file)
                                        : FitProfiles(args, common);
  const std::int64_t bytes = factor::WriteSss(args.out, material);
  constexpr const char* kLost =
      "pitch, refractive index, what lies beyond the grid; R_d as sums of Gaussians";
  Say(common, std::string("lost: ") + kLost);
  Json json{{"file", args.out.string()},
            {"bytes", bytes},
            {"gaussians", material.terms},
            {"unit", "R_d per cell of pitch^2, lengths in pitches"},
            {"lost", kLost}};
  if (const auto error = material.error.find("relative_l2");
      error != material.error.end()) {
    json["residual"] = error->second;
  }
  Print(common, json, args.out.string());
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
               const ExportArguments& args,
               const Common& common) {
  const exchange::ProfileFit fit = Fit(args.file, common);
  Json json = exchange::ExportMaps(target, fit, args.file, args.name, args.out);
  json["out"] = args.out.string();
  Say(common, "fit: " + fit.summary.Brief());
  Say(common, std::string("lost: ") + target.lost);
  Print(common, json, args.out.string() + ": for " + target.program);
  return 0;
}

int Run(ExportArguments& args, const Common& common) {
  args.name = args.file.lexically_normal().filename().string();
#ifdef NACRE_HAS_PRESETS
  args.file = preset::MaterialPath(args.file);
#endif
  if (args.to == "psf") {
    return ToPsf(args, common);
  }
  std::string known = "psf";
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
  throw UsageError("--to " + args.to + ": this build writes " + known);
}

}  // namespace

std::function<int()> MakeExportVerb(CLI::App& app, const Common& common) {
  const auto args = std::make_shared<ExportArguments>();
  app.add_option("file",
                 args->file,
                 "dataset, *.rd.exr; to sss and renderers also *.nacre.exr or a preset")
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
