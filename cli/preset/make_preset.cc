#include "cli/preset/make_preset.h"

#include "cli/exchange/profile_fit.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/exr.h"
#include "core/hash.h"
#include "core/png.h"
#include "factor/material.h"
#include "render/render.h"
#include "render/tone.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numbers>

namespace nacre::preset {
namespace {

namespace fs = std::filesystem;

// Grey level that the mean of the thumbnails' bright pixels is brought to: dark
// materials would be black balls otherwise. Bright ones aren't made darker.
constexpr double kWanted = 0.45;
constexpr double kMostStops = 3;

double Exposure(const ExrPart& image) {
  double sum = 0;
  double weight = 0;
  for (const float value : image.values) {
    const auto v = std::min(static_cast<double>(value), 4.0);
    sum += v * v;
    weight += v;
  }
  const double level = weight > 0 ? sum / weight : kWanted;
  return std::clamp(std::log2(kWanted / level), -1.0, kMostStops);
}

void RenderThumbnail(const MakeInputs& inputs,
                     const Preset& preset,
                     const MakeOptions& options,
                     const ProgressFunction& progress) {
  // The scene's ball has radius 1; the sample goes round it once.
  const double mm_per_unit = preset.width_mm / (2 * std::numbers::pi);
  render::SceneOptions scene;
  scene.defines = {{"material", fs::absolute(preset.File("material")).string()},
                   {"res", std::to_string(options.thumbnail_px)},
                   {"mm", fmt::format("{:.9g}", mm_per_unit)}};
  render::RenderOptions render;
  render.spp = options.thumbnail_spp;
  render.thread_count = options.thread_count;
  render.points_per_patch = 4;
  const ExrPart image =
      render::Render(render::ReadScene(inputs.scene, scene), render, progress).image;
  WritePng(preset.File("thumbnail"), render::ToPng(image, Exposure(image)), 9);
}

void WriteMaps(const factor::Material& material,
               const Preset& preset,
               const MakeOptions& options,
               const ProgressFunction& progress) {
  const auto [maps, summary] =
      exchange::FitProfiles(material, options.thread_count, progress);
  WriteExr(preset.File("albedo"), {exchange::MapPicture(maps, maps.albedo)});
  WriteExr(preset.File("radius"), {exchange::MapPicture(maps, maps.d_mm)});
  WriteExr(preset.File("residual"), {exchange::MapPicture(maps, maps.residual)});
}

}  // namespace

Preset MakePreset(const MakeInputs& inputs,
                  const fs::path& library,
                  const MakeOptions& options,
                  const ProgressFunction& progress) {
  Validate(options);
  CheckName(options.name);
  const factor::Material material = factor::ReadMaterial(inputs.material);
  Preset preset;
  preset.folder = library / options.name;
  preset.name = options.name;
  preset.title = options.title.empty() ? options.name : options.title;
  preset.author = options.author;
  preset.licence = options.licence;
  preset.notes = options.notes;
  preset.width_mm = material.points_x * material.pitch_mm;
  preset.height_mm = material.points_y * material.pitch_mm;
  preset.eta = material.eta;
  preset.method = material.method;
  preset.terms = material.terms;
  preset.error = material.error;
  if (!inputs.dataset.empty()) {
    preset.dataset_file = inputs.dataset.filename().string();
    preset.dataset_hash = HashFile(inputs.dataset);
  }
  preset.files = {{"material", "material.nacre.exr"},
                  {"albedo", "albedo.exr"},
                  {"radius", "radius.exr"},
                  {"residual", "residual.exr"},
                  {"thumbnail", "thumbnail.png"}};
  const std::string bytes = ReadFile(inputs.material);
  fs::create_directories(preset.folder);
  WriteFile(preset.File("material"), bytes);
  WriteMaps(material, preset, options, progress);
  RenderThumbnail(inputs, preset, options, progress);
  WritePreset(preset);
  return preset;
}

}  // namespace nacre::preset
