#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace nacre::render {

/// Where materials are looked for by name, in this order: `scene_folder`, the working
/// folder, the folders of NACRE_PRESET_PATH (separated by colons),
/// $XDG_DATA_HOME/nacre/presets (~/.local/share if that isn't set), share/nacre/presets
/// beside the program or its bin, and where it was to be installed.
std::vector<std::filesystem::path> PresetFolders(
    const std::filesystem::path& scene_folder);

/// The material of that name: the file itself, `<name>.nacre.exr`, or that of the
/// preset
/// `<name>`, in the first folder that has one. Throws BadData listing where it looked.
std::filesystem::path FindPreset(const std::string& name,
                                 const std::filesystem::path& scene_folder);

}  // namespace nacre::render
