// nacre preset: the library of materials that artists pick from.

#include "cli/preset/preset.h"

#include "cli/command_line.h"
#include "cli/preset/make_preset.h"
#include "cli/resources.h"
#include "core/error.h"
#include "render/preset_path.h"

#include <filesystem>
#include <memory>

namespace nacre::cli {
namespace {

namespace fs = std::filesystem;

struct PresetArguments {
  std::vector<std::string> folders;  // searched before all others
  std::string name;                  // or a folder
  preset::MakeInputs inputs;
  fs::path library = "presets";
  preset::MakeOptions make;
};

// The scene folder of PresetFolders is where the options' folders come in; the working
// folder is searched too, as by scenes.
std::vector<fs::path> Folders(const PresetArguments& args) {
  std::vector<fs::path> folders(args.folders.begin(), args.folders.end());
  for (fs::path& folder : render::PresetFolders(".")) {
    folders.push_back(std::move(folder));
  }
  return folders;
}

std::vector<preset::Preset> All(const PresetArguments& args, const Common& common) {
  std::vector<std::string> problems;
  std::vector<preset::Preset> presets = preset::FindPresets(Folders(args), problems);
  for (const std::string& problem : problems) {
    Say(common, "left out: " + problem);
  }
  return presets;
}

preset::Preset Find(const PresetArguments& args, const Common& common) {
  if (fs::is_regular_file(fs::path(args.name) / "preset.toml")) {
    return preset::ReadPreset(args.name);
  }
  std::string known;
  for (preset::Preset& preset : All(args, common)) {
    if (preset.name == args.name) {
      return std::move(preset);
    }
    known += (known.empty() ? "" : ", ") + preset.name;
  }
  std::string looked;
  for (const fs::path& folder : Folders(args)) {
    looked += "\n  " + folder.string();
  }
  throw BadData("no preset '" + args.name + "'; there are: " +
                (known.empty() ? "none" : known) + "; looked in" + looked);
}

int List(const PresetArguments& args, const Common& common) {
  Json presets = Json::array();
  std::string text;
  for (const preset::Preset& preset : All(args, common)) {
    presets.push_back(preset::ToJson(preset));
    text += fmt::format("{}{:<22} {:>5.0f} x {:<5.0f} mm  {:>4.0f} kB  {}",
                        text.empty() ? "" : "\n",
                        preset.name,
                        preset.width_mm,
                        preset.height_mm,
                        static_cast<double>(preset.Bytes()) / 1000,
                        preset.title);
  }
  Print(common, {{"presets", presets}}, text.empty() ? "no presets" : text);
  return 0;
}

int Show(const PresetArguments& args, const Common& common) {
  const preset::Preset preset = Find(args, common);
  const Json json = preset::ToJson(preset);
  std::string text;
  for (const auto& [key, value] : json.items()) {
    text += fmt::format("{}{:<10}{}",
                        text.empty() ? "" : "\n",
                        key,
                        value.is_string() ? value.get<std::string>() : value.dump());
  }
  Print(common, json, text);
  return 0;
}

int Check(const PresetArguments& args, const Common& common) {
  std::vector<preset::Preset> presets;
  if (args.name.empty()) {
    presets = All(args, common);
  } else {
    presets.push_back(Find(args, common));
  }
  Json json = Json::array();
  std::string text;
  std::size_t broken = 0;
  for (const preset::Preset& preset : presets) {
    const std::vector<std::string> problems = preset::CheckPreset(preset);
    broken += problems.empty() ? 0 : 1;
    json.push_back({{"name", preset.name},
                    {"folder", preset.folder.string()},
                    {"problems", problems}});
    text += fmt::format(
        "{}{}: {}",
        text.empty() ? "" : "\n",
        preset.name,
        problems.empty() ? "whole" : fmt::format("{}", fmt::join(problems, "; ")));
  }
  Print(common, {{"presets", json}, {"broken", broken}}, text);
  return static_cast<int>(broken == 0 ? ExitCode::kDone : ExitCode::kBadData);
}

int Make(PresetArguments& args, const Common& common) {
  args.inputs.scene = FindResource("scenes/thumbnail.xml");
  args.make.thread_count = common.thread_count;
  const preset::Preset preset =
      preset::MakePreset(args.inputs, args.library, args.make, ConsoleProgress(common));
  Print(common,
        preset::ToJson(preset),
        fmt::format("{}: {:.0f} kB",
                    preset.folder.string(),
                    static_cast<double>(preset.Bytes()) / 1000));
  return 0;
}

}  // namespace

std::function<int()> MakePresetVerb(CLI::App& app, const Common& common) {
  const auto args = std::make_shared<PresetArguments>();
  const auto action = std::make_shared<std::function<int()>>();
  app.require_subcommand(1);
  app.fallthrough();
  app.add_option("--presets",
                 args->folders,
                 "folders of presets, searched before NACRE_PRESET_PATH and the others")
      ->allow_extra_args(false);
  const auto add = [&](const char* name, const char* summary, auto run) {
    CLI::App* command = app.add_subcommand(name, summary);
    command->callback([args, action, run, &common] {
      *action = [args, run, &common] { return run(*args, common); };
    });
    return command;
  };
  CLI::App* make = add("make", "a preset of a material", Make);
  make->add_option("material", args->inputs.material, "*.nacre.exr")->required();
  make->add_option("--dataset", args->inputs.dataset, "that it was factored from")
      ->check(CLI::ExistingFile);
  make->add_option("--out", args->library, "folder of presets to put it in")
      ->capture_default_str();
  AddOptions(*make, args->make);
  make->get_option("--name")->required();
  add("list", "presets that scenes and the add-on find by name", List);
  add("show", "all that is known of one", Show)
      ->add_option("name", args->name, "a preset's name, or its folder")
      ->required();
  add("check", "whether presets are whole: exit code 3 unless they are", Check)
      ->add_option(
          "name", args->name, "a preset's name, or its folder; all if not given");
  return [action] { return (*action)(); };
}

}  // namespace nacre::cli
