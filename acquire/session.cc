#include "acquire/session.h"

#include "acquire/frame_file.h"
#include "acquire/mosaic.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/json.h"

#include <algorithm>
#include <fmt/format.h>

namespace nacre::acquire {
namespace {

constexpr const char* kFormat = "nacre session";
constexpr int kFormatVersion = 1;
constexpr std::uint64_t kMaxManifestBytes = 64 << 20;

Json ToJson(const CameraInfo& camera) {
  return Json{{"model", camera.model},
              {"serial", camera.serial},
              {"width_px", camera.width},
              {"height_px", camera.height},
              {"bit_depth", camera.bit_depth},
              {"min_exposure_us", camera.min_exposure_us},
              {"max_exposure_us", camera.max_exposure_us},
              {"mosaic", camera.mosaic}};
}

CameraInfo CameraFromJson(const Json& json, const std::string& origin) {
  CameraInfo camera{.model = Get<std::string>(json, "model", origin),
                    .serial = Get<std::string>(json, "serial", origin),
                    .width = Get<int>(json, "width_px", origin),
                    .height = Get<int>(json, "height_px", origin),
                    .bit_depth = Get<int>(json, "bit_depth", origin),
                    .min_exposure_us = Get<double>(json, "min_exposure_us", origin),
                    .max_exposure_us = Get<double>(json, "max_exposure_us", origin),
                    .mosaic = json.contains("mosaic")
                                  ? Get<std::string>(json, "mosaic", origin)
                                  : ""};
  if (camera.width < 1 || camera.height < 1 || camera.width > 1 << 16 ||
      camera.height > 1 << 16 || camera.bit_depth < 8 || camera.bit_depth > 16) {
    throw BadData(origin + ": field 'camera': no such sensor");
  }
  return camera;
}

Json ToJson(const IlluminatorInfo& illuminator) {
  return Json{{"model", illuminator.model},
              {"serial", illuminator.serial},
              {"channels", illuminator.channels},
              {"max_angle_rad", illuminator.max_angle_rad}};
}

IlluminatorInfo IlluminatorFromJson(const Json& json, const std::string& origin) {
  return {.model = Get<std::string>(json, "model", origin),
          .serial = Get<std::string>(json, "serial", origin),
          .channels = Get<std::vector<std::string>>(json, "channels", origin),
          .max_angle_rad = Get<double>(json, "max_angle_rad", origin)};
}

Json ToJson(const AdaptivePlan& plan) {
  Json points = Json::array();
  for (const GridIndex& point : plan.empty_points) {
    points.push_back({point.i, point.j});
  }
  return Json{{"omitted_exposures", plan.omitted_exposures}, {"empty_points", points}};
}

AdaptivePlan PlanFromJson(const Json& json, const std::string& origin) {
  AdaptivePlan plan;
  plan.omitted_exposures = Get<std::vector<int>>(json, "omitted_exposures", origin);
  for (const auto& [i, j] :
       Get<std::vector<std::pair<int, int>>>(json, "empty_points", origin)) {
    plan.empty_points.push_back({i, j});
  }
  return plan;
}

RigDescription RigOf(const SessionManifest& manifest,
                     const std::filesystem::path& folder) {
  return ParseRig(manifest.rig_text, folder / manifest.rig_file);
}

// Whether `spots` are points of `group` in its order; all of them unless the capture
// was adaptive.
bool AreOfGroup(const std::vector<GridIndex>& spots,
                std::span<const GridIndex> group,
                bool all) {
  auto at = group.begin();
  for (const GridIndex& spot : spots) {
    at = std::find(at, group.end(), spot);
    if (at == group.end()) {
      return false;
    }
    ++at;
  }
  return !all || spots.size() == group.size();
}

bool SamePicture(const ScheduledPicture& a, const ScheduledPicture& b) {
  return a.target == b.target && a.pose == b.pose && a.channel == b.channel &&
         a.group == b.group && a.repeat == b.repeat && a.exposure_us == b.exposure_us;
}

}  // namespace

SessionManifest ReadManifest(const std::filesystem::path& folder) {
  const std::filesystem::path path = folder / "session.json";
  if (!std::filesystem::exists(path)) {
    throw BadData(folder.string() + ": not a session folder: it has no session.json");
  }
  const std::string origin = path.string();
  const Json json = ParseJson(ReadFile(path, kMaxManifestBytes), origin);
  if (Get<std::string>(json, "format", origin) != kFormat) {
    throw BadData(origin + ": not the manifest of a session");
  }
  if (const int version = Get<int>(json, "format_version", origin);
      version != kFormatVersion) {
    throw BadData(fmt::format(
        "{}: format version {}; this build reads {}", origin, version, kFormatVersion));
  }
  SessionManifest manifest;
  manifest.software_version = Get<std::string>(json, "software_version", origin);
  manifest.rig_file = Get<std::string>(json, "rig_file", origin);
  manifest.rig_hash = Get<std::string>(json, "rig_xxh3", origin);
  manifest.rig_text = Get<std::string>(json, "rig", origin);
  if (HashHex(manifest.rig_text.data(), manifest.rig_text.size()) !=
      manifest.rig_hash) {
    throw BadData(origin + ": field 'rig' doesn't match its checksum 'rig_xxh3'");
  }
  if (!Get<Json>(json, "seed", origin).is_null()) {
    manifest.seed = Get<std::uint64_t>(json, "seed", origin);
  }
  manifest.picture_count = Get<std::int64_t>(json, "picture_count", origin);
  manifest.camera = CameraFromJson(Get<Json>(json, "camera", origin), origin);
  manifest.illuminator =
      IlluminatorFromJson(Get<Json>(json, "illuminator", origin), origin);
  const Json map = Get<Json>(json, "scan_map", origin);
  if (!map.is_null()) {
    manifest.scan_map = ScanMapFromJson(map, origin + ": scan_map");
  }
  if (json.contains("adaptive_plan")) {
    manifest.adaptive_plan =
        PlanFromJson(json["adaptive_plan"], origin + ": adaptive_plan");
  }
  if (json.contains("captured_unix_s")) {
    manifest.captured_unix_s = Get<std::int64_t>(json, "captured_unix_s", origin);
  }
  return manifest;
}

void WriteManifest(const std::filesystem::path& folder,
                   const SessionManifest& manifest) {
  const Schedule schedule(RigOf(manifest, folder));
  Json json{{"format", kFormat},
            {"format_version", kFormatVersion},
            {"software_version", manifest.software_version},
            {"rig_file", manifest.rig_file},
            {"rig_xxh3", manifest.rig_hash},
            {"rig", manifest.rig_text},
            {"seed", manifest.seed ? Json(*manifest.seed) : Json()},
            {"picture_count", manifest.picture_count},
            {"first_sample_picture", schedule.grid_begin()},
            {"spot_groups", schedule.group_count()},
            {"exposures_us", schedule.exposures_us()},
            {"camera", ToJson(manifest.camera)},
            {"illuminator", ToJson(manifest.illuminator)},
            {"scan_map", manifest.scan_map ? ToJson(*manifest.scan_map) : Json()}};
  if (manifest.adaptive_plan) {
    json["adaptive_plan"] = ToJson(*manifest.adaptive_plan);
  }
  if (manifest.captured_unix_s) {
    json["captured_unix_s"] = *manifest.captured_unix_s;
  }
  WriteJson(folder / "session.json", json);
}

SessionReader::SessionReader(std::filesystem::path folder, FrameView view)
    : folder_(std::move(folder)),
      view_(view),
      manifest_(ReadManifest(folder_)),
      rig_(RigOf(manifest_, folder_)),
      schedule_(rig_) {
  const std::filesystem::path path = folder_ / "journal";
  journal_ = ParseJournal(ReadFile(path), path.string()).entries;
  if (manifest_.picture_count != schedule_.size() ||
      picture_count() > schedule_.size()) {
    throw BadData(fmt::format(
        "{}: {} pictures were scheduled and {} taken, but the rig description in it "
        "calls for {}; it was captured by version {}, read it with that",
        folder_.string(),
        manifest_.picture_count,
        picture_count(),
        schedule_.size(),
        manifest_.software_version));
  }
  for (const JournalEntry& entry : journal_) {
    const ScheduledPicture& picture = schedule_[entry.number];
    const auto group = picture.group >= 0 ? schedule_.Group(picture.group)
                                          : std::span<const GridIndex>();
    const bool adaptive = manifest_.adaptive_plan.has_value();
    const bool may_be_skipped = adaptive && picture.target == Target::kSample;
    if ((entry.taken() ? entry.file != FrameFileName(entry.number) : !may_be_skipped) ||
        !SamePicture(entry.picture, picture) ||
        !AreOfGroup(entry.spots, group, entry.taken() && !adaptive)) {
      throw BadData(
          fmt::format("{}:{}: picture {} isn't the one that the schedule calls for",
                      path.string(),
                      entry.number + 1,
                      entry.number));
    }
  }
}

const JournalEntry& SessionReader::Entry(std::int64_t number) const {
  Expect(number >= 0 && number < schedule_.size(), "a picture of the schedule");
  if (number >= picture_count()) {
    throw BadData(fmt::format(
        "{}: picture {} of {} hasn't been taken; finish with nacre capture --resume",
        folder_.string(),
        number,
        schedule_.size()));
  }
  return journal_[static_cast<std::size_t>(number)];
}

Frame SessionReader::ReadFrame(std::int64_t number) const {
  const JournalEntry& entry = Entry(number);
  if (!entry.taken()) {
    throw BadData(fmt::format(
        "{}: picture {} was left out: {}", folder_.string(), number, entry.skipped));
  }
  const std::filesystem::path path = folder_ / entry.file;
  if (!std::filesystem::exists(path)) {
    throw BadData(
        fmt::format("{}: picture {} is in the journal, but the file is "
                    "missing; was the session copied whole?",
                    path.string(),
                    number));
  }
  const std::string bytes = ReadFile(path);
  if (HashHex(bytes.data(), bytes.size()) != entry.hash) {
    throw BadData(path.string() +
                  ": doesn't match its checksum in the journal; it was damaged or "
                  "changed after the capture");
  }
  Frame frame = DecodeFrame(bytes, path.string());
  const std::size_t pixels =
      static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height);
  if (frame.width != manifest_.camera.width ||
      frame.height != manifest_.camera.height ||
      frame.counts.size() !=
          pixels * static_cast<std::size_t>(manifest_.camera.SamplesPerPixel())) {
    throw BadData(fmt::format("{}: {} x {} pixels, but the camera has {} x {}",
                              path.string(),
                              frame.width,
                              frame.height,
                              manifest_.camera.width,
                              manifest_.camera.height));
  }
  if (view_ == FrameView::kGrey) {
    MakeGrey(frame, manifest_.camera.mosaic);
  }
  frame.exposure_us = entry.exposure_us;
  frame.frame_id = entry.frame_id;
  frame.timestamp_ns = entry.timestamp_ns;
  frame.gain = entry.gain;
  frame.temperature_c = entry.temperature_c;
  return frame;
}

}  // namespace nacre::acquire
