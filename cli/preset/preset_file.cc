// preset.toml, read and written.

#include "cli/preset/preset.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/json.h"
#include "core/toml.h"

#include <algorithm>
#include <array>
#include <fmt/format.h>

namespace nacre::preset {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFormat = "nacre-preset";
constexpr int kVersion = 1;

constexpr std::array kErrors = {
    "relative_l2", "log_rms", "rmse_over_mean", "psnr_db", "worst_slice", "peak"};

// A basic string of TOML is written as JSON writes one, except for the delete
// character.
std::string Quoted(std::string text) {
  text.erase(std::remove(text.begin(), text.end(), '\x7f'), text.end());
  return Json(text).dump();
}

std::string FileName(const TomlTable& table, const std::string& key) {
  std::string name = table.Text(key);
  const fs::path path(name);
  if (name.empty() || path.has_parent_path() || name == "." || name == "..") {
    throw table.At(key,
                   "'" + name + "': the name of a file in the preset's own folder");
  }
  return name;
}

// A preset is somebody else's folder: what its links lead to isn't its own.
void RefuseLinkOut(const TomlTable& files,
                   const std::string& role,
                   const Preset& preset) {
  const fs::path file = fs::weakly_canonical(preset.File(role));
  if (file.parent_path() != fs::weakly_canonical(preset.folder)) {
    throw files.At(role,
                   "a link to " + file.string() + ", outside of the preset's folder");
  }
}

void ReadFiles(const TomlTable& files, Preset& preset) {
  const TomlTable hashes = files.Table("xxh3");
  for (const std::string& role : Roles()) {
    preset.files[role] = FileName(files, role);
    RefuseLinkOut(files, role, preset);
    preset.hashes[role] = hashes.Text(role);
  }
  hashes.RejectUnknownKeys();
  files.RejectUnknownKeys();
}

void ReadErrors(const TomlTable& errors, Preset& preset) {
  for (const char* key : kErrors) {
    if (errors.Has(key)) {
      preset.error[key] = errors.Number(key);
    }
  }
  errors.RejectUnknownKeys();
}

}  // namespace

Preset ReadPreset(const fs::path& folder) {
  const fs::path file = folder / "preset.toml";
  const TomlTable table = TomlTable::FromFile(file);
  if (table.Text("format") != kFormat) {
    throw table.At("format", fmt::format("not '{}': no preset of ours", kFormat));
  }
  if (table.Integer("version") != kVersion) {
    throw table.At("version",
                   fmt::format("this program reads version {} only", kVersion));
  }
  Preset preset;
  preset.folder = folder;
  preset.name = table.Text("name");
  try {
    CheckName(preset.name);
  } catch (const Error& e) {
    throw table.At("name", e.what());
  }
  preset.title = table.Text("title");
  preset.author = table.Text("author");
  preset.licence = table.Text("licence");
  preset.notes = table.Text("notes", "");
  const std::vector<double> size = table.Numbers("size_mm", Range{1e-6, 1e6});
  if (size.size() != 2) {
    throw table.At("size_mm", "width and height");
  }
  preset.width_mm = size[0];
  preset.height_mm = size[1];
  preset.eta = table.Number("eta", {1, 4});
  preset.method = table.Text("method");
  preset.terms = table.Integer("terms", {1, 4096});
  const TomlTable dataset = table.Table("dataset");
  preset.dataset_file = dataset.Text("file");
  preset.dataset_hash = dataset.Text("xxh3");
  dataset.RejectUnknownKeys();
  ReadErrors(table.Table("error"), preset);
  ReadFiles(table.Table("files"), preset);
  table.RejectUnknownKeys();
  return preset;
}

void WritePreset(Preset& preset) {
  std::string text = fmt::format(
      "format = {}\nversion = {}\n\nname = {}\ntitle = {}\nauthor = {}\nlicence = "
      "{}\nnotes = {}\n\nsize_mm = [{:.9g}, {:.9g}]\neta = {:.9g}\nmethod = {}\nterms "
      "= "
      "{}\n\n[dataset]  # that the material was factored from\nfile = {}\nxxh3 = "
      "{}\n\n[error]  # of the material against the dataset\n",
      Quoted(kFormat),
      kVersion,
      Quoted(preset.name),
      Quoted(preset.title),
      Quoted(preset.author),
      Quoted(preset.licence),
      Quoted(preset.notes),
      preset.width_mm,
      preset.height_mm,
      preset.eta,
      Quoted(preset.method),
      preset.terms,
      Quoted(preset.dataset_file),
      Quoted(preset.dataset_hash));
  for (const auto& [name, value] : preset.error) {
    if (std::find(kErrors.begin(), kErrors.end(), name) != kErrors.end()) {
      // With a point or an exponent, so that TOML takes it for a float.
      text += fmt::format("{} = {:.4e}\n", name, value);
    }
  }
  text += "\n[files]\n";
  for (const std::string& role : Roles()) {
    text += fmt::format("{} = {}\n", role, Quoted(preset.files.at(role)));
  }
  text += "\n[files.xxh3]\n";
  for (const std::string& role : Roles()) {
    preset.hashes[role] = HashFile(preset.File(role));
    text += fmt::format("{} = {}\n", role, Quoted(preset.hashes[role]));
  }
  WriteFile(preset.folder / "preset.toml", text);
}

}  // namespace nacre::preset
