#include "cli/preset/preset.h"
#include "core/error.h"
#include "core/exr.h"
#include "core/hash.h"
#include "core/png.h"
#include "factor/material.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <functional>

namespace nacre::preset {
namespace {

constexpr std::int64_t kMostBytes = 1'000'000;
constexpr double kMostLight = 1.01;  // 1 % is measurement

using Problems = std::vector<std::string>;

void CheckMaterial(const Preset& preset, Problems& problems) {
  const factor::Material material = factor::ReadMaterial(preset.File("material"));
  const auto differs = [&](const char* what, auto said, auto is) {
    if (said != is) {
      problems.push_back(
          fmt::format("preset.toml says {} = {}, the material {}", what, said, is));
    }
  };
  differs("method", preset.method, material.method);
  differs("terms", preset.terms, material.terms);
  differs(
      "eta", fmt::format("{:.6g}", preset.eta), fmt::format("{:.6g}", material.eta));
  differs("width_mm",
          fmt::format("{:.6g}", preset.width_mm),
          fmt::format("{:.6g}", material.points_x * material.pitch_mm));
  differs("height_mm",
          fmt::format("{:.6g}", preset.height_mm),
          fmt::format("{:.6g}", material.points_y * material.pitch_mm));
  float brightest = 0;
  for (const float albedo : material.albedo) {
    brightest = std::max(brightest, albedo);
  }
  if (static_cast<double>(brightest) > kMostLight) {
    problems.push_back(
        fmt::format("more light leaves than came in: an albedo of {:.3f}", brightest));
  }
}

void CheckMap(const Preset& preset,
              const std::string& role,
              const factor::Material& material,
              Problems& problems) {
  const std::vector<ExrPart> parts = ReadExr(preset.File(role));
  if (parts.size() != 1 || parts[0].width != material.points_x ||
      parts[0].height != material.points_y) {
    problems.push_back(fmt::format("{} isn't one picture of a pixel a grid point",
                                   preset.files.at(role)));
    return;
  }
  const float most = role == "radius" ? INFINITY : 1.0F;
  for (const float value : parts[0].values) {
    if (!(value >= 0 && value <= most) || !std::isfinite(value)) {
      problems.push_back(
          fmt::format("{} has a value of {}", preset.files.at(role), value));
      return;
    }
  }
}

}  // namespace

std::vector<std::string> CheckPreset(const Preset& preset) {
  Problems problems;
  if (std::filesystem::absolute(preset.folder).lexically_normal().filename() !=
      preset.name) {
    problems.push_back("the folder isn't called '" + preset.name +
                       "', so that a scene doesn't find it by this name");
  }
  if (preset.author.empty() || preset.licence.empty()) {
    problems.emplace_back("no author or no licence");
  }
  bool all_there = true;
  for (const auto& [role, file] : preset.files) {
    if (!std::filesystem::is_regular_file(preset.folder / file)) {
      problems.push_back(file + " is missing");
      all_there = false;
    } else if (HashFile(preset.folder / file) != preset.hashes.at(role)) {
      problems.push_back(file + " isn't the file of preset.toml: another checksum");
    }
  }
  const auto step = [&](const std::function<void()>& check) {
    try {
      check();
    } catch (const Error& e) {
      problems.emplace_back(e.what());
    }
  };
  if (!all_there) {
    return problems;
  }
  step([&] { CheckMaterial(preset, problems); });
  step([&] {
    const factor::Material material = factor::ReadMaterial(preset.File("material"));
    for (const char* role : {"albedo", "radius", "residual"}) {
      step([&] { CheckMap(preset, role, material, problems); });
    }
  });
  step([&] { ReadPng(preset.File("thumbnail")); });
  if (preset.Bytes() > kMostBytes) {
    problems.push_back(
        fmt::format("{} bytes; a preset has {} at most", preset.Bytes(), kMostBytes));
  }
  return problems;
}

}  // namespace nacre::preset
