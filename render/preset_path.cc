#include "render/preset_path.h"

#include "core/error.h"

#include <cstdlib>
#include <fmt/format.h>
#include <sstream>

namespace nacre::render {
namespace {

std::string Environment(const char* name) {
  const char* const value = std::getenv(name);
  return value != nullptr ? value : "";
}

}  // namespace

std::vector<std::filesystem::path> PresetFolders(
    const std::filesystem::path& scene_folder) {
  std::vector<std::filesystem::path> folders = {scene_folder, "."};
  std::stringstream list(Environment("NACRE_PRESET_PATH"));
  for (std::string folder; std::getline(list, folder, ':');) {
    if (!folder.empty()) {
      folders.emplace_back(folder);
    }
  }
  const std::string data_home = Environment("XDG_DATA_HOME");
  const std::string home = Environment("HOME");
  if (!data_home.empty()) {
    folders.push_back(std::filesystem::path(data_home) / "nacre/presets");
  } else if (!home.empty()) {
    folders.push_back(std::filesystem::path(home) / ".local/share/nacre/presets");
  }
  std::error_code unknown;  // then the installed ones remain
  const auto program = std::filesystem::read_symlink("/proc/self/exe", unknown);
  if (!unknown) {  // a build folder, or one that was moved
    const std::filesystem::path bin = program.parent_path();
    folders.push_back(bin / "share/nacre/presets");
    folders.push_back(bin.parent_path() / "share/nacre/presets");
  }
  folders.push_back(std::filesystem::path(NACRE_DATA_DIR) / "presets");
  return folders;
}

std::filesystem::path FindPreset(const std::string& name,
                                 const std::filesystem::path& scene_folder) {
  if (name.empty()) {
    throw BadData("a material without a name");
  }
  std::string looked;
  for (const std::filesystem::path& folder : PresetFolders(scene_folder)) {
    for (const std::string& file :
         {name, name + ".nacre.exr", name + "/material.nacre.exr"}) {
      std::filesystem::path path = folder / file;
      std::error_code none;
      if (std::filesystem::is_regular_file(path, none)) {
        return path;
      }
    }
    looked += fmt::format("\n  {}", folder.string().empty() ? "." : folder.string());
  }
  throw BadData(fmt::format(
      "no material '{}': neither that file, nor '{}.nacre.exr', nor a "
      "preset's folder is in any of{}\nset NACRE_PRESET_PATH to the folder it is in",
      name,
      name,
      looked));
}

}  // namespace nacre::render
