#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace nacre::render {

/// Where materials are looked for by name, in this order: `scene_folder`, the working
/// folder, the folders of NACRE_PRESET_PATH (separated by colons),
/// $XDG_DATA_HOME/nacre/presets (~/.local/share if that isn't set), and the folder of
/// the installed program.
std::vector<std::filesystem::path> PresetFolders(
    const std::filesystem::path& scene_folder);

/// The material of that name: the file itself, or `<name>.nacre.exr`, in the first
/// folder that has it. Throws BadData listing where it looked.
std::filesystem::path FindPreset(const std::string& name,
                                 const std::filesystem::path& scene_folder);

}  // namespace nacre::render
