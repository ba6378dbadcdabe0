// nacre render: a scene with its materials to a picture.

#include "render/render.h"

#include "cli/command_line.h"
#include "core/error.h"
#include "core/options_json.h"
#include "core/png.h"
#include "core/provenance.h"
#include "render/denoise.h"
#include "render/tev.h"
#include "render/tone.h"

#include <filesystem>
#include <memory>
#include <optional>

namespace nacre::cli {
namespace {

struct RenderArguments {
  std::filesystem::path scene;
  std::filesystem::path out;
  std::filesystem::path png;
  std::vector<std::string> defines;
  bool lenient = false;
  bool allow_outside = false;
  double material_error = 0;
  bool stats = false;
  bool reference = false;
  bool adaptive = false;
  bool denoise = false;
  std::filesystem::path checkpoint;
  std::string tev;
  double exposure_ev = 0;
  render::RenderOptions options;
};

void AddArguments(CLI::App& app, RenderArguments& arguments) {
  app.add_option("scene", arguments.scene, "scene in Mitsuba's XML (0.4 to 0.6)")
      ->required();
  app.add_option("--out", arguments.out, "picture: .exr (linear) or .png (sRGB)")
      ->required();
  app.add_option("--png", arguments.png, "write this PNG too");
  app.add_option("--exposure", arguments.exposure_ev, "of the PNG, in stops")
      ->capture_default_str()
      ->check(CLI::Range(-64.0, 64.0));
  app.add_option("-D", arguments.defines, "name=value for a $name in the scene")
      ->allow_extra_args(false);
  app.add_flag("--lenient",
               arguments.lenient,
               "unknown words in the scene are left out with a warning");
  app.add_flag("--allow-outside",
               arguments.allow_outside,
               "the scene may name files that aren't in its folder; those given by -D "
               "it may always");
  app.add_option(
         "--material-error",
         arguments.material_error,
         "leave out last terms of factored materials that together change R_d by "
         "at most this much of its largest value")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1.0));
  app.add_flag("--stats", arguments.stats, "print where time went and what was done");
  app.add_flag(
      "--reference", arguments.reference, "the same as --integrator reference");
  app.add_flag("--adaptive", arguments.adaptive, "the same as --sampling adaptive");
  app.add_option("--checkpoint",
                 arguments.checkpoint,
                 "keep all samples in this file every ten seconds; if it is there "
                 "already, go on from it");
  app.add_flag("--denoise",
               arguments.denoise,
               "take the noise out by Open Image Denoise, if it is installed; with "
               "--aovs the noisy picture and what the denoiser looked at are kept");
  app.add_option("--tev",
                 arguments.tev,
                 "HOST:PORT of a tev that shows the picture as it is made, every "
                 "--snapshot seconds or every two; tev's own port is :14158");
  AddOptions(app, arguments.options);
}

std::map<std::string, std::string> ParseDefines(const std::vector<std::string>& words) {
  std::map<std::string, std::string> defines;
  for (const std::string& word : words) {
    const std::size_t equals = word.find('=');
    if (equals == 0 || equals == std::string::npos) {
      throw UsageError("-D " + word + ": it must be name=value");
    }
    defines[word.substr(0, equals)] = word.substr(equals + 1);
  }
  return defines;
}

std::string RenderProvenance(const render::Scene& scene,
                             const RenderArguments& arguments) {
  Provenance provenance;
  provenance.command = "render";
  provenance.options = OptionsToJson(arguments.options);
  // These don't change the picture.
  for (const char* name : {"snapshot", "thread_count", "aovs"}) {
    provenance.options.erase(name);
  }
  provenance.options["seed"] = arguments.options.seed;
  provenance.options["define"] = arguments.defines;
  if (arguments.denoise) {
    provenance.options["denoise"] = true;
  }
  if (arguments.material_error > 0) {
    provenance.options["material_error"] = arguments.material_error;
  }
  for (const std::filesystem::path& file : scene.files) {
    provenance.AddInput(file);
  }
  return provenance.ToString();
}

// What a sample depends on: a picture may be gone on with to more of them.
std::string IdentityOf(const std::string& provenance) {
  Json identity = ParseJson(provenance, "provenance");
  for (const char* name : {"spp", "time_limit", "error_target", "sampling"}) {
    identity["options"].erase(name);
  }
  return identity.dump();
}

bool IsPng(const std::filesystem::path& path) {
  return path.extension() == ".png";
}

void WriteImage(const std::filesystem::path& path,
                std::vector<ExrPart> parts,
                const RenderArguments& arguments,
                const std::string& provenance) {
  ExrPart& image = parts.front();
  if (IsPng(path)) {
    WritePng(path, render::ToPng(image, arguments.exposure_ev));
    return;
  }
  if (parts.size() > 1) {
    image.name = "image";
  }
  image.attributes["nacre.kind"] = "image";
  image.attributes["nacre.provenance"] = provenance;
  WriteExr(path, parts);
}

// The picture in `parts` without its noise; with AOVs, also what that was made from.
void DenoiseFirst(std::vector<ExrPart>& parts,
                  const render::Scene& scene,
                  const render::RenderOptions& options) {
  const render::FeatureImages features =
      render::FirstHitFeatures(scene, options.seed, options.thread_count);
  ExrPart noisy = parts.front();
  parts.front() = render::Denoise(noisy, features);
  if (options.aovs) {
    noisy.name = "noisy";
    parts.push_back(std::move(noisy));
    parts.push_back(features.albedo);
    parts.push_back(features.normal);
  }
}

// Refuses what can't be done, before anything is read, and fills the options.
void Settle(RenderArguments& arguments, const Common& common) {
  if (!IsPng(arguments.out) && arguments.out.extension() != ".exr") {
    throw UsageError("--out " + arguments.out.string() +
                     ": the name must end in .exr or .png");
  }
  render::RenderOptions& options = arguments.options;
  if (arguments.reference) {
    options.integrator = "reference";
  }
  if (arguments.adaptive) {
    options.sampling = "adaptive";
  }
  options.seed = common.seed;
  options.thread_count = common.thread_count;
  options.ranks = common.ranks;
  if (arguments.denoise) {
    render::RequireDenoiser();
  }
}

int Run(RenderArguments& arguments, const Common& common) {
  Settle(arguments, common);
  render::RenderOptions& options = arguments.options;
  const render::Scene scene =
      render::ReadScene(arguments.scene,
                        {.defines = ParseDefines(arguments.defines),
                         .lenient = arguments.lenient,
                         .allow_outside = arguments.allow_outside,
                         .material_error = arguments.material_error});
  for (const std::string& note : scene.notes) {
    Say(common, note);
  }
  const std::string provenance = RenderProvenance(scene, arguments);
  const auto save = [&](const std::vector<ExrPart>& parts) {
    WriteImage(arguments.out, parts, arguments, provenance);
    if (!arguments.png.empty()) {
      WriteImage(arguments.png, parts, arguments, provenance);
    }
  };
  std::optional<render::TevDisplay> display;
  const bool saves = options.snapshot_s > 0;
  if (!arguments.tev.empty() && common.IsRoot()) {
    display.emplace(arguments.tev);
    constexpr double kShowEvery = 2;
    options.snapshot_s = saves ? options.snapshot_s : kShowEvery;
  }
  const auto show = [&](const ExrPart& image) {
    if (display && !display->Show(arguments.out.filename().string(), image)) {
      Say(common, "tev has gone; the picture goes on without it");
      display.reset();
    }
  };
  const render::Rendering rendering =
      render::Render(scene,
                     options,
                     ConsoleProgress(common),
                     [&](const ExrPart& image) {
                       show(image);
                       if (saves) {
                         save({image});
                       }
                     },
                     {arguments.checkpoint, IdentityOf(provenance)});
  if (!common.IsRoot()) {
    return 0;
  }
  for (const std::string& lost : rendering.summary.ranks_lost) {
    Say(common, "warning: " + lost + " (its tiles were rendered by others)");
  }
  std::vector<ExrPart> parts = rendering.aovs;
  parts.insert(parts.begin(), rendering.image);
  if (arguments.denoise) {
    DenoiseFirst(parts, scene, options);
  }
  save(parts);
  show(parts.front());
  const render::Invariants& invariants = rendering.summary.invariants;
  for (const std::string& warning : invariants.Warnings()) {
    Say(common, "warning: " + warning);
  }
  Json json = rendering.summary.ToJson();
  json["out"] = arguments.out.string();
  Print(common,
        json,
        (arguments.stats ? rendering.summary.Table() : rendering.summary.Brief()) +
            "\n" + invariants.Brief());
  return 0;
}

}  // namespace

std::function<int()> MakeRenderVerb(CLI::App& app, const Common& common) {
  auto arguments = std::make_shared<RenderArguments>();
  AddArguments(app, *arguments);
  return [arguments, &common] { return Run(*arguments, common); };
}

}  // namespace nacre::cli
