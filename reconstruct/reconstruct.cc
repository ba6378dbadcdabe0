#include "reconstruct/reconstruct.h"

#include "core/error.h"
#include "core/hash.h"
#include "core/parallel.h"
#include "core/provenance.h"
#include "reconstruct/internal/group_slices.h"
#include "reconstruct/internal/slice_spool.h"
#include "reconstruct/internal/spot_width.h"
#include "reconstruct/rd_dataset.h"

#include <algorithm>
#include <chrono>
#include <fmt/format.h>

namespace nacre::reconstruct {
namespace {

using internal::GroupReader;
using internal::GroupSlices;
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
  const GroupReader reader(
      session, calibration, header, summary.spot_sigma_mm, options.thread_count);
  RdWriter writer(out, header);
  const int groups = session.schedule().group_count();
  const int threads = ThreadCount(options.thread_count);
  for (int first = 0; first < groups; first += threads) {
    Report(progress, {"reconstruct", first, groups, ""});
    const int count = std::min(threads, groups - first);
    std::vector<GroupSlices> results(static_cast<std::size_t>(count));
    ParallelFor(count, threads, [&](std::int64_t k) {
      results[static_cast<std::size_t>(k)] = reader.Read(first + static_cast<int>(k));
    });
    for (int k = 0; k < count; ++k) {
      const GroupSlices& result = results[static_cast<std::size_t>(k)];
      const auto spots = session.schedule().Group(first + k);
      for (std::size_t n = 0; n < spots.size(); ++n) {
        writer.WriteSlice(spots[n].i, spots[n].j, result.slices[n]);
      }
      summary.frame_count += result.frame_count;
      summary.saturated_count += result.saturated_count;
      summary.invalid_count += result.invalid_count;
      summary.slice_count += std::ssize(spots);
    }
  }
  writer.Finish();
  Report(progress, {"reconstruct", groups, groups, ""});
  summary.thread_count_used = threads;
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
