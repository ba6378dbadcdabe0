#pragma once

#include "core/json_fwd.h"

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace nacre::preset {

/// A material that an artist can pick from a list: a folder with `preset.toml` and the
/// files that it names. See README.md.
struct Preset {
  std::filesystem::path folder;  ///< isn't written
  std::string name;              ///< the folder's: what scenes call it
  std::string title;             ///< for people
  std::string author;
  std::string licence;
  std::string notes;  ///< where the optical parameters are from, and what to know
  double width_mm = 0;
  double height_mm = 0;
  std::string dataset_file;  ///< that it was factored from, empty if not known
  std::string dataset_hash;  ///< XXH3-128
  std::string method;
  int terms = 0;
  double eta = 1;
  std::map<std::string, double> error;  ///< of the fit; `relative_l2`, `log_rms`, …
  /// Files by role ("material", "albedo", "radius", "residual", "thumbnail"), relative,
  /// and their hashes.
  std::map<std::string, std::string> files;
  std::map<std::string, std::string> hashes;

  std::filesystem::path File(const std::string& role) const;
  std::int64_t Bytes() const;  ///< of all files
};

/// The files that every preset has.
const std::vector<std::string>& Roles();

/// Throws BadData unless `name` can be a folder, a value in a scene and a word on a
/// command line: letters, digits, '-', '_' and '.', not a '.' first, at most 64.
void CheckName(const std::string& name);

/// Reads `folder`/preset.toml; the files it names aren't opened. Throws BadData with
/// file:line, also for names that lead out of the folder.
Preset ReadPreset(const std::filesystem::path& folder);

/// The material of a preset, if `path` is a preset's folder, or no file but the name of
/// a preset that scenes would find (render/preset_path.h); else `path` itself.
std::filesystem::path MaterialPath(const std::filesystem::path& path);

/// Writes preset.folder/preset.toml, with the hashes of the files that are there.
void WritePreset(Preset& preset);

/// What is wrong with a preset, each as one sentence; empty if it is whole. Opens every
/// file, compares hashes, and holds the material to the laws: R_d ≥ 0, no window gives
/// more than came in.
std::vector<std::string> CheckPreset(const Preset& preset);

/// All presets of the folders, by name; of two with the same name the first. A folder
/// that isn't there holds none. `problems` gets what couldn't be read.
std::vector<Preset> FindPresets(const std::vector<std::filesystem::path>& folders,
                                std::vector<std::string>& problems);

Json ToJson(const Preset& preset);

}  // namespace nacre::preset
