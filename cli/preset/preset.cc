#include "cli/preset/preset.h"

#include "core/error.h"
#include "core/json.h"
#include "render/preset_path.h"

#include <algorithm>
#include <set>

namespace nacre::preset {

namespace fs = std::filesystem;

const std::vector<std::string>& Roles() {
  static const std::vector<std::string> roles{
      "material", "albedo", "radius", "residual", "thumbnail"};
  return roles;
}

void CheckName(const std::string& name) {
  constexpr std::size_t kLongest = 64;
  const auto fits = [](char c) {
    return (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') ||
           c == '-' || c == '_' || c == '.';
  };
  if (name.empty() || name.size() > kLongest || name.front() == '.' ||
      !std::all_of(name.begin(), name.end(), fits)) {
    throw BadData(
        "a preset can't be called '" + name +
        "': letters, digits, '-', '_' and '.' only, no '.' first, at most 64");
  }
}

fs::path Preset::File(const std::string& role) const {
  const auto found = files.find(role);
  Expect(found != files.end(), "the role of a preset's file");
  return folder / found->second;
}

std::int64_t Preset::Bytes() const {
  auto bytes = static_cast<std::int64_t>(fs::file_size(folder / "preset.toml"));
  for (const auto& [role, file] : files) {
    bytes += static_cast<std::int64_t>(fs::file_size(folder / file));
  }
  return bytes;
}

fs::path MaterialPath(const fs::path& path) {
  if (fs::is_regular_file(path / "preset.toml")) {
    return ReadPreset(path).File("material");
  }
  const bool is_name = !fs::exists(path) && !path.has_extension();
  return is_name ? render::FindPreset(path.string(), "") : path;
}

std::vector<Preset> FindPresets(const std::vector<fs::path>& folders,
                                std::vector<std::string>& problems) {
  std::vector<Preset> presets;
  std::set<std::string> seen;
  for (const fs::path& folder : folders) {
    std::error_code missing;
    for (const auto& entry : fs::directory_iterator(folder, missing)) {
      if (!fs::is_regular_file(entry.path() / "preset.toml")) {
        continue;
      }
      try {
        Preset preset = ReadPreset(entry.path());
        if (seen.insert(preset.name).second) {
          presets.push_back(std::move(preset));
        }
      } catch (const Error& e) {
        problems.emplace_back(e.what());
      }
    }
  }
  std::sort(presets.begin(), presets.end(), [](const Preset& a, const Preset& b) {
    return a.name < b.name;
  });
  std::sort(problems.begin(), problems.end());
  return presets;
}

Json ToJson(const Preset& preset) {
  return {{"name", preset.name},
          {"title", preset.title},
          {"author", preset.author},
          {"licence", preset.licence},
          {"notes", preset.notes},
          {"size_mm", {preset.width_mm, preset.height_mm}},
          {"eta", preset.eta},
          {"dataset", {{"file", preset.dataset_file}, {"xxh3", preset.dataset_hash}}},
          {"method", preset.method},
          {"terms", preset.terms},
          {"error", preset.error},
          {"folder", fs::absolute(preset.folder).lexically_normal().string()},
          {"files", preset.files},
          {"bytes", preset.Bytes()}};
}

}  // namespace nacre::preset
