#include "reconstruct/reconstruct.h"

#include "core/error.h"
#include "core/hash.h"
#include "core/options_json.h"
#include "core/parallel.h"
#include "core/provenance.h"
#include "reconstruct/internal/crosstalk.h"
#include "reconstruct/internal/group_slices.h"
#include "reconstruct/internal/slice_spool.h"
#include "reconstruct/internal/spot_width.h"
#include "reconstruct/rd_dataset.h"

#include <algorithm>
#include <chrono>
#include <fmt/format.h>
#include <optional>

namespace nacre::reconstruct {
namespace {

using internal::Crosstalk;
using internal::GroupReader;
using internal::GroupSlices;
using internal::OutsideCell;
using internal::SliceSpool;

void CheckSameRig(const acquire::SessionReader& session,
                  const calibrate::Calibration& calibration) {
  const acquire::SessionManifest& manifest = session.manifest();
  if (calibration.session_rig_hash != manifest.rig_hash) {
    throw BadData(fmt::format(
        "{}: was captured with rig {}, the calibration is of rig {}: calibrate this "
        "session",
        session.folder().string(),
        manifest.rig_hash,
        calibration.session_rig_hash));
  }
  if (calibration.camera.width_px != manifest.camera.width ||
      calibration.camera.height_px != manifest.camera.height) {
    throw BadData(
        fmt::format("{}: its pictures have {} x {} pixels, the calibrated "
                    "camera {} x {}",
                    session.folder().string(),
                    manifest.camera.width,
                    manifest.camera.height,
                    calibration.camera.width_px,
                    calibration.camera.height_px));
  }
  if (std::ssize(calibration.channels) != session.rig().ChannelCount()) {
    throw BadData(fmt::format("{}: {} laser channels, the calibration has {}",
                              session.folder().string(),
                              session.rig().ChannelCount(),
                              calibration.channels.size()));
  }
  if (!session.IsComplete()) {
    throw BadData(fmt::format(
        "{}: {} of {} pictures were taken; go on with nacre capture --resume",
        session.folder().string(),
        session.picture_count(),
        session.schedule().size()));
  }
}

RdHeader HeaderOf(const acquire::SessionReader& session,
                  const calibrate::Calibration& calibration,
                  const ReconstructOptions& options) {
  const acquire::RigDescription& rig = session.rig();
  RdHeader header;
  header.points_x = rig.grid.points_x;
  header.points_y = rig.grid.points_y;
  header.core = rig.grid.core;
  header.pitch_mm = rig.grid.pitch_mm;
  header.eta = rig.sample.eta;
  header.channels = rig.scanner.channels;
  Provenance provenance{.command = "reconstruct", .options = OptionsToJson(options)};
  // The journal holds the hash of every picture.
  provenance.AddInput(session.folder() / "session.json");
  provenance.AddInput(session.folder() / "journal");
  provenance.inputs.push_back(
      {{"calibration",
        Json::accept(calibration.provenance) ? Json::parse(calibration.provenance)
                                             : Json(calibration.provenance)}});
  header.provenance = provenance.ToString();
  Validate(header, session.folder().string());
  return header;
}

// As many groups side by side as the memory is for, and no more than threads.
int GroupsAtOnce(const GroupReader& reader, const ReconstructOptions& options) {
  const double left = options.memory_bytes - static_cast<double>(reader.SharedBytes());
  const double affordable = left / static_cast<double>(reader.WorkingBytes());
  return static_cast<int>(
      std::clamp<double>(affordable, 1, ThreadCount(options.thread_count)));
}

std::filesystem::path AbsoluteFolder(const std::filesystem::path& path) {
  return std::filesystem::absolute(path).parent_path();
}

// Pass 1: pictures to slices, as measured, parked in `spool`.
void Measure(const acquire::SessionReader& session,
             const calibrate::Calibration& calibration,
             const ReconstructOptions& options,
             const RdHeader& header,
             SliceSpool& spool,
             std::vector<OutsideCell>& outside,
             ReconstructSummary& summary,
             const ProgressFunction& progress) {
  const GroupReader reader(
      session, calibration, header, summary.spot_sigma_mm, options.thread_count);
  const int groups = session.schedule().group_count();
  const int at_once = GroupsAtOnce(reader, options);
  summary.thread_count_used = at_once;
  for (int first = 0; first < groups; first += at_once) {
    Report(progress, {"reconstruct", first, groups, "pictures"});
    const int count = std::min(at_once, groups - first);
    std::vector<GroupSlices> results(static_cast<std::size_t>(count));
    ParallelFor(count, at_once, [&](std::int64_t k) {
      results[static_cast<std::size_t>(k)] = reader.Read(first + static_cast<int>(k));
    });
    for (int k = 0; k < count; ++k) {
      const GroupSlices& result = results[static_cast<std::size_t>(k)];
      const auto spots = session.schedule().Group(first + k);
      for (std::size_t n = 0; n < spots.size(); ++n) {
        spool.Park(std::int64_t{spots[n].j} * header.points_x + spots[n].i,
                   result.slices[n]);
      }
      outside.insert(outside.end(), result.outside.begin(), result.outside.end());
      summary.frame_count += result.frame_count;
      summary.saturated_count += result.saturated_count;
      summary.invalid_count += result.invalid_count;
      summary.slice_count += std::ssize(spots);
    }
  }
  Report(progress, {"reconstruct", groups, groups, "pictures"});
}

// Pass 2: slices, freed of each other's light, in the order of the file.
void WriteSlices(const acquire::SessionReader& session,
                 const ReconstructOptions& options,
                 const RdHeader& header,
                 const SliceSpool& spool,
                 const std::vector<OutsideCell>& outside,
                 RdWriter& writer,
                 ReconstructSummary& summary,
                 const ProgressFunction& progress) {
  std::optional<Crosstalk> crosstalk;
  if (options.subtract_crosstalk) {
    Report(progress, {"crosstalk", 0, header.points_y, "tails"});
    crosstalk.emplace(header, session.schedule(), spool, outside, options.thread_count);
  }
  const auto width = static_cast<std::size_t>(header.points_x);
  for (int j = 0; j < header.points_y; ++j) {
    Report(progress, {"crosstalk", j, header.points_y, "slices"});
    constexpr std::size_t kSlicesAtOnce = 64;
    for (std::size_t first = 0; first < width; first += kSlicesAtOnce) {
      const std::size_t count = std::min(kSlicesAtOnce, width - first);
      std::vector<RdSlice> slices(count);
      std::vector<double> shares(count, 0.0);
      ParallelFor(std::ssize(slices), options.thread_count, [&](std::int64_t n) {
        const auto k = static_cast<std::size_t>(n);
        const std::int64_t s =
            std::int64_t{j} * header.points_x + static_cast<std::int64_t>(first + k);
        slices[k] = crosstalk ? crosstalk->Clean(s, &shares[k]) : spool.Fetch(s);
      });
      for (std::size_t k = 0; k < count; ++k) {
        writer.WriteSlice(static_cast<int>(first + k), j, slices[k]);
        summary.max_crosstalk = std::max(summary.max_crosstalk, shares[k]);
      }
    }
  }
  Report(progress, {"crosstalk", header.points_y, header.points_y, "slices"});
}

}  // namespace

ReconstructSummary Reconstruct(const acquire::SessionReader& session,
                               const calibrate::Calibration& calibration,
                               const std::filesystem::path& out,
                               const ReconstructOptions& options,
                               const ProgressFunction& progress) {
  nacre::Validate(options);
  const auto start = std::chrono::steady_clock::now();
  CheckSameRig(session, calibration);
  const RdHeader header = HeaderOf(session, calibration, options);
  ReconstructSummary summary;
  summary.spot_sigma_mm =
      options.sharpen_spot ? internal::MeasureSpotSigmaMm(session, calibration) : 0;
  RdWriter writer(out, header);
  SliceSpool spool(AbsoluteFolder(out), header);
  std::vector<OutsideCell> outside;
  Measure(session, calibration, options, header, spool, outside, summary, progress);
  WriteSlices(session, options, header, spool, outside, writer, summary, progress);
  writer.Finish();
  summary.seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return summary;
}

std::string ReconstructSummary::Brief() const {
  return fmt::format(
      "{} slices of {} frames in {:.1f} s; {} pixels saturated, {} values invalid, "
      "crosstalk at most {:.2g} of a slice",
      slice_count,
      frame_count,
      seconds,
      saturated_count,
      invalid_count,
      max_crosstalk);
}

}  // namespace nacre::reconstruct
