// nacre inspect: what a file is, where it came from, and whether it is whole.

#include "cli/artefact.h"
#include "cli/command_line.h"
#include "cli/inspect_files.h"
#include "cli/remake.h"
#include "core/error.h"
#include "core/hash.h"
#include "reconstruct/rd_dataset.h"
#ifdef NACRE_HAS_ACQUIRE
#include "acquire/session.h"
#endif
#ifdef NACRE_HAS_CALIBRATE
#include "calibrate/calibration.h"
#endif
#include "factor/material.h"
#ifdef NACRE_HAS_PRESETS
#include "cli/preset/preset.h"
#endif
#ifdef NACRE_HAS_RIGS
#include "rigs/phantom.h"
#endif

#include <cmath>
#include <cstdint>
#include <memory>
#include <span>

namespace nacre::cli {
namespace {

struct InspectArguments {
  std::filesystem::path file;
  bool provenance = false;
};

// What the values of a channel are.
struct ChannelContents {
  ValueRange values;
  ValueRange albedos;
  std::int64_t invalid = 0;
  std::int64_t negative = 0;

  void Add(std::span<const float> rd,
           std::span<const std::uint8_t> valid,
           double cell_area_mm2) {
    double total = 0;
    for (std::size_t k = 0; k < rd.size(); ++k) {
      if (valid[k] == 0) {
        ++invalid;
        continue;
      }
      const auto value = static_cast<double>(rd[k]);
      values.Add(value);
      negative += value < 0 ? 1 : 0;
      total += value;
    }
    albedos.Add(total * cell_area_mm2);
  }
};

// What a pass over all slices, which verifies their checksums, finds.
Json DatasetContents(reconstruct::RdReader& reader, const ProgressFunction& progress) {
  const reconstruct::RdHeader& header = reader.header();
  const auto window = static_cast<std::size_t>(header.WindowSize());
  std::vector<ChannelContents> contents(header.channels.size());
  for (int j = 0; j < header.points_y; ++j) {
    Report(progress, {"inspect", j, header.points_y, ""});
    for (int i = 0; i < header.points_x; ++i) {
      const reconstruct::RdSlice slice = reader.ReadSlice(i, j);
      for (std::size_t c = 0; c < contents.size(); ++c) {
        contents[c].Add({&slice.rd[c * window], window},
                        {&slice.valid[c * window], window},
                        header.CellAreaMm2());
      }
    }
  }
  Json channels = Json::array();
  std::int64_t invalid = 0;
  std::int64_t negative = 0;
  for (std::size_t c = 0; c < contents.size(); ++c) {
    channels.push_back({{"name", header.channels[c]},
                        {"rd_per_mm2", contents[c].values.ToJson()},
                        {"albedo", contents[c].albedos.ToJson()}});
    invalid += contents[c].invalid;
    negative += contents[c].negative;
  }
  return {{"channels", channels},
          {"invalid_values", invalid},
          {"negative_values", negative},
          {"checksums", fmt::format("{} slices verified", header.PointCount())}};
}

Json InspectDataset(const std::filesystem::path& path, const Common& common) {
  reconstruct::RdReader reader(path);
  const reconstruct::RdHeader& header = reader.header();
  const std::int64_t values = header.PointCount() * header.SliceSize();
  Json json{{"points", {header.points_x, header.points_y}},
            {"core", header.core},
            {"pitch_mm", header.pitch_mm},
            {"window_mm", header.core * header.pitch_mm},
            {"eta", header.eta},
            {"units", "mm^-2"},
            {"memory_bytes", 9 * values}};
  json.update(DatasetContents(reader, ConsoleProgress(common)));
  json["provenance"] = ProvenanceOf(header.provenance);
  return json;
}

Json InspectMaterial(const std::filesystem::path& path) {
  const factor::Material material = factor::ReadMaterial(path);
  return {{"method", material.method},
          {"terms", material.terms},
          {"clusters", material.cluster_count},
          {"points", {material.points_x, material.points_y}},
          {"core", material.core},
          {"pitch_mm", material.pitch_mm},
          {"window_mm", material.core * material.pitch_mm},
          {"eta", material.eta},
          {"channels", material.channels},
          {"form", factor::Name(material.form)},
          {"rounded", !material.steps.empty()},
          {"storage_bytes", material.StorageBytes()},
          {"error", material.error},
          {"checksums", "verified"},
          {"provenance", ProvenanceOf(material.provenance)}};
}

Json InspectSession(const std::filesystem::path& path, const Common& common) {
#ifdef NACRE_HAS_ACQUIRE
  const acquire::SessionReader session(path);
  const acquire::RigDescription& rig = session.rig();
  const ProgressFunction progress = ConsoleProgress(common);
  std::int64_t taken = 0;
  for (std::int64_t n = 0; n < session.picture_count(); ++n) {
    Report(progress, {"inspect", n, session.picture_count(), "checksums"});
    if (session.WasTaken(n)) {
      session.ReadFrame(n);  // throws if the picture isn't the one of the journal
      ++taken;
    }
  }
  const bool complete = session.IsComplete();
  const acquire::CameraInfo& camera = session.manifest().camera;
  return {{"sample", rig.sample.name},
          {"rig", session.manifest().rig_file},
          {"rig_hash", session.manifest().rig_hash},
          {"camera",
           {{"model", camera.model},
            {"size", {camera.width, camera.height}},
            {"bits", camera.bit_depth}}},
          {"illuminator", session.manifest().illuminator.model},
          {"channels", rig.scanner.channels},
          {"points", {rig.grid.points_x, rig.grid.points_y}},
          {"core", rig.grid.core},
          {"pitch_mm", rig.grid.pitch_mm},
          {"pictures", session.picture_count()},
          {"pictures_left_out", session.picture_count() - taken},
          {"pictures_planned", session.schedule().size()},
          {"complete", complete},
          {"resumable", !complete},
          {"scan_map", session.manifest().scan_map.has_value()},
          {"checksums", fmt::format("{} pictures verified", taken)},
          {"provenance", {{"version", session.manifest().software_version}}}};
#else
  (void)common;
  throw UsageError(path.string() +
                   ": is a session, and this build was made without `acquire`");
#endif
}

Json InspectCalibration(const std::filesystem::path& path) {
#ifdef NACRE_HAS_CALIBRATE
  const calibrate::Calibration c = calibrate::ReadCalibration(path);
  Json channels = Json::array();
  for (const calibrate::ChannelResponse& channel : c.channels) {
    channels.push_back(
        {{"name", channel.name},
         {"flux_scale_counts_mm2_sr_per_us", channel.flux_scale_counts_mm2_sr_per_us},
         {"flux_scale_spread", channel.flux_scale_spread}});
  }
  const calibrate::PixelPoint centre{0.5 * (c.camera.width_px - 1),
                                     0.5 * (c.camera.height_px - 1)};
  return {{"camera", {{"size", {c.camera.width_px, c.camera.height_px}}}},
          {"pixel_mm", std::sqrt(c.camera.FootprintMm2(centre))},
          {"reprojection_rms_px", c.reprojection_rms_px},
          {"laser_map_rms_mm", c.laser_map_rms_mm},
          {"laser_map_max_mm", c.laser_map_max_mm},
          {"dark_offset_counts", c.dark.offset_counts},
          {"dark_rate_counts_per_us", c.dark.rate_counts_per_us},
          {"gain_electrons_per_count", c.gain_electrons_per_count},
          {"read_noise_electrons", c.read_noise_electrons},
          {"saturation_counts", c.saturation_counts},
          {"channels", channels},
          {"session_rig_hash", c.session_rig_hash},
          {"provenance", ProvenanceOf(c.provenance)}};
#else
  throw UsageError(path.string() +
                   ": is a calibration, and this build was made without `calibrate`");
#endif
}

#ifdef NACRE_HAS_PRESETS

// A preset is its material and what was said of it.
Json PresetProvenance(const preset::Preset& p) {
  const Json material = InspectMaterial(p.File("material")).at("provenance");
  Json options{{"name", p.name},
               {"title", p.title},
               {"author", p.author},
               {"licence", p.licence},
               {"notes", p.notes}};
  return {{"software", "nacre"},
          {"version", material.is_object() ? material.value("version", "") : ""},
          {"command", "preset make"},
          {"options", std::move(options)},
          {"inputs", Json::array({{{"material", material}}})}};
}

#endif

Json InspectPreset(const std::filesystem::path& path) {
#ifdef NACRE_HAS_PRESETS
  const preset::Preset p = preset::ReadPreset(path);
  const std::vector<std::string> problems = preset::CheckPreset(p);
  if (!problems.empty()) {
    throw BadData(path.string() + ": " + problems.front());
  }
  return {{"name", p.name},
          {"title", p.title},
          {"author", p.author},
          {"licence", p.licence},
          {"size_mm", {p.width_mm, p.height_mm}},
          {"method", p.method},
          {"terms", p.terms},
          {"eta", p.eta},
          {"error", p.error},
          {"bytes", p.Bytes()},
          {"checksums", "verified"},
          {"provenance", PresetProvenance(p)}};
#else
  throw UsageError(path.string() +
                   ": is a preset, and this build was made without `render`");
#endif
}

Json InspectPhantom(const std::filesystem::path& path) {
#ifdef NACRE_HAS_RIGS
  const rigs::Phantom phantom = rigs::ReadPhantom(path);
  Json media = Json::array();
  for (const rigs::Medium& medium : phantom.media) {
    media.push_back({{"name", medium.name},
                     {"sigma_a_per_mm", medium.sigma_a_per_mm},
                     {"sigma_s_per_mm", medium.sigma_s_per_mm},
                     {"g", medium.g}});
  }
  return {{"channels", phantom.channels},
          {"thickness_mm",
           std::isfinite(phantom.slab.thickness_mm) ? Json(phantom.slab.thickness_mm)
                                                    : Json("inf")},
          {"eta", phantom.slab.eta},
          {"bottom", rigs::Name(phantom.slab.bottom)},
          {"media", media},
          {"points", {phantom.grid.points_x, phantom.grid.points_y}},
          {"core", phantom.grid.core},
          {"pitch_mm", phantom.grid.pitch_mm}};
#else
  throw UsageError(path.string() +
                   ": is a phantom, and this build was made without `rigs`");
#endif
}

Json InspectRig(const std::filesystem::path& path) {
#ifdef NACRE_HAS_ACQUIRE
  const acquire::RigDescription rig = acquire::ReadRig(path);
  return {{"rig_kind", rig.kind},
          {"sample", rig.sample.name},
          {"channels", rig.scanner.channels},
          {"points", {rig.grid.points_x, rig.grid.points_y}},
          {"core", rig.grid.core},
          {"pitch_mm", rig.grid.pitch_mm},
          {"pictures_planned", acquire::Schedule(rig).size()},
          {"hash", rig.hash}};
#else
  throw UsageError(path.string() +
                   ": is a rig, and this build was made without `acquire`");
#endif
}

Json Inspect(const std::filesystem::path& path,
             ArtefactKind kind,
             const Common& common) {
  switch (kind) {
    case ArtefactKind::kDataset:
      return InspectDataset(path, common);
    case ArtefactKind::kMaterial:
      return InspectMaterial(path);
    case ArtefactKind::kExrPicture:
      return InspectExr(path);
    case ArtefactKind::kPngPicture:
      return InspectPng(path);
    case ArtefactKind::kSession:
      return InspectSession(path, common);
    case ArtefactKind::kPreset:
      return InspectPreset(path);
    case ArtefactKind::kCalibration:
      return InspectCalibration(path);
    case ArtefactKind::kPhantom:
      return InspectPhantom(path);
    case ArtefactKind::kRig:
      return InspectRig(path);
    case ArtefactKind::kReport:
      return InspectReport(path);
    case ArtefactKind::kExport:
      return InspectExport(path);
    case ArtefactKind::kPlyMesh:
      return InspectPly(path);
    case ArtefactKind::kObjMesh:
      return InspectObj(path);
    case ArtefactKind::kUnknown:
      break;
  }
  throw BadData(
      path.string() +
      ": is none of: dataset, material, preset, session, calibration, phantom, rig, "
      "picture (.exr, .png), mesh (.ply, .obj), report (.html), export (a folder)");
}

// One line a key; lists of objects one line an element.
std::string ToText(const Json& json) {
  std::string text;
  for (const auto& [key, value] : json.items()) {
    const bool table = value.is_array() && !value.empty() && value[0].is_object();
    if (!table) {
      text += fmt::format("{:<20}{}\n",
                          key,
                          value.is_string() ? value.get<std::string>() : value.dump());
      continue;
    }
    for (const Json& element : value) {
      text += fmt::format("{:<20}{}\n", key, element.dump());
    }
  }
  if (!text.empty()) {
    text.pop_back();
  }
  return text;
}

// For people the commands that remake the file; as JSON all that is recorded too.
void PrintProvenance(const Json& provenance,
                     const InspectArguments& args,
                     const Common& common) {
  if (!provenance.is_object()) {
    throw Error(args.file.string() + ": carries no provenance");
  }
  const std::vector<std::string> commands =
      CommandsThatRemake(provenance, args.file.filename().string());
  Json json = provenance;
  json["commands"] = commands;
  Print(common,
        json,
        fmt::format("# by nacre {}\n{}",
                    provenance.value("version", "of unknown version"),
                    fmt::join(commands, "\n")));
}

int Run(const InspectArguments& args, const Common& common) {
  const ArtefactKind kind = DetectKind(args.file);
  Json json{{"file", args.file.string()}, {"kind", Name(kind)}};
  if (std::filesystem::is_regular_file(args.file)) {
    json["bytes"] = std::filesystem::file_size(args.file);
    json["xxh3"] = HashFile(args.file);
  }
  json.update(Inspect(args.file, kind, common));
  if (args.provenance) {
    PrintProvenance(json.value("provenance", Json()), args, common);
    return 0;
  }
  Print(common, json, ToText(json));
  return 0;
}

}  // namespace

std::function<int()> MakeInspectVerb(CLI::App& app, const Common& common) {
  const auto args = std::make_shared<InspectArguments>();
  app.add_option("file", args->file, "anything nacre reads or writes")->required();
  app.add_flag(
      "--provenance",
      args->provenance,
      "the commands that remake it and the hashes of what they need; with --json all "
      "that is recorded");
  app.footer(
      "Reads all of the file and verifies its checksums: exit code 3 if it isn't "
      "whole.");
  return [args, &common] { return Run(*args, common); };
}

}  // namespace nacre::cli
