#include "reconstruct/reconstruct.h"

#include "acquire/read_ahead.h"
#include "calibrate/session_state.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/options_json.h"
#include "core/parallel.h"
#include "core/provenance.h"
#include "core/ranks.h"
#include "reconstruct/internal/gloss.h"
#include "reconstruct/internal/group_reader.h"
#include "reconstruct/internal/group_spool.h"
#include "reconstruct/internal/separation.h"
#include "reconstruct/internal/spot_width.h"
#include "reconstruct/internal/write_slices.h"
#include "reconstruct/rd_dataset.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fmt/format.h>
#include <optional>

namespace nacre::reconstruct {
namespace {

// One up whenever the same pictures give other values.
constexpr int kReconstructionVersion = 5;

using internal::GroupPicture;
using internal::GroupReader;
using internal::GroupSpool;
using internal::Separation;

void CheckSameRig(const acquire::SessionReader& session,
                  const calibrate::Calibration& calibration,
                  bool may_be_incomplete) {
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
  if (calibration.corrections.filters.mosaic != manifest.camera.mosaic) {
    throw BadData(fmt::format(
        "{}: its pictures' colours are '{}', those of the calibration's '{}'; "
        "calibrate "
        "this session (pictures of three counts a pixel can't be: capture in a Bayer "
        "or monochrome pixel format)",
        session.folder().string(),
        manifest.camera.mosaic,
        calibration.corrections.filters.mosaic));
  }
  if (std::ssize(calibration.channels) != session.rig().ChannelCount()) {
    throw BadData(fmt::format("{}: {} laser channels, the calibration has {}",
                              session.folder().string(),
                              session.rig().ChannelCount(),
                              calibration.channels.size()));
  }
  if (!session.IsComplete() && !may_be_incomplete) {
    throw BadData(fmt::format(
        "{}: {} of {} pictures were taken; go on with nacre capture --resume, or take "
        "what is there with --incremental",
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

// The plane as far as it is known: none if noise alone may have made it, and else in
// steps that matter to nothing, so that a few more pictures don't move it and what was
// made of the others can stay.
calibrate::SamplePlane Settle(calibrate::SamplePlane plane) {
  constexpr double kSigmas = 4;
  constexpr double kHeightStepMm = 0.02;
  constexpr double kSlopeStep = 2e-4;
  const double slope = std::hypot(plane.slope_x, plane.slope_y);
  if (std::abs(plane.height_mm) < kSigmas * plane.height_sigma_mm + kHeightStepMm &&
      slope < kSigmas * plane.slope_sigma + kSlopeStep) {
    return {};
  }
  plane.height_mm = std::round(plane.height_mm / kHeightStepMm) * kHeightStepMm;
  plane.slope_x = std::round(plane.slope_x / kSlopeStep) * kSlopeStep;
  plane.slope_y = std::round(plane.slope_y / kSlopeStep) * kSlopeStep;
  return plane;
}

// As many groups side by side as the memory is for, and no more than threads.
int GroupsAtOnce(const GroupReader& reader, const ReconstructOptions& options) {
  const double left = options.memory_bytes - static_cast<double>(reader.SharedBytes());
  const double affordable =
      left / static_cast<double>(reader.WorkingBytes() + reader.ResultBytes());
  return static_cast<int>(
      std::clamp<double>(affordable, 1, ThreadCount(options.thread_count)));
}

std::filesystem::path WorkFile(const std::filesystem::path& out) {
  return std::filesystem::absolute(out).string() + ".work";
}

// All that the pictures of the groups depend on, beside the pictures themselves. The
// calibration is hashed as it would be written.
std::uint64_t KeyOf(const acquire::SessionReader& session,
                    const calibrate::Calibration& calibration,
                    const std::filesystem::path& work,
                    const calibrate::SpotProfile& spot,
                    const Ranks* ranks) {
  // A name of its own for each rank.
  const std::filesystem::path written = fmt::format(
      "{}.{}.calibration.json", work.string(), ranks == nullptr ? 0 : ranks->rank());
  calibrate::WriteCalibration(written, calibration);
  const std::string hash = HashFile(written);
  std::filesystem::remove(written);
  const std::string text =
      fmt::format("{} {} {} {} {} {}",
                  kReconstructionVersion,
                  session.manifest().rig_hash,
                  hash,  // of the camera over the sample's plane too
                  spot.xx_mm2,
                  spot.xy_mm2,
                  spot.yy_mm2);
  return Hash64(text.data(), text.size());
}

// Pass 1: pictures to the lattice, parked in `spool`. Which thread does what doesn't
// matter: each group has its own place.
void Measure(const GroupReader& reader,
             const ReconstructOptions& options,
             GroupSpool& spool,
             ReconstructSummary& summary,
             const ProgressFunction& progress) {
  std::vector<int> all;  // that are to be read
  for (int g = 0; g < static_cast<int>(summary.group_count); ++g) {
    if (!reader.IsThere(g)) {
      ++summary.groups_missing;
    } else if (options.incremental && spool.TakeUp(g, reader.StateOf(g))) {
      ++summary.groups_reused;
    } else {
      all.push_back(g);
    }
  }
  const RankShare share = ShareOf(std::ssize(all), options.ranks);
  const std::vector<int> wanted(all.begin() + share.begin, all.begin() + share.end);
  const int at_once = GroupsAtOnce(reader, options);
  summary.thread_count_used = at_once;
  const auto total = std::ssize(wanted);
  // Long enough that waiting for the last of a batch doesn't cost, short enough to
  // stop.
  const std::int64_t batch = 8 * at_once;
  std::vector<std::int64_t> pictures;
  std::vector<std::size_t> begins;  // of each group's
  for (const int g : wanted) {
    begins.push_back(pictures.size());
    reader.AddPictures(g, pictures);
  }
  acquire::ReadAhead ahead(reader.session(), pictures);
  for (std::int64_t first = 0; first < total; first += batch) {
    Report(progress, {"reconstruct", first, total, "pictures"});
    const std::int64_t count = std::min(batch, total - first);
    const auto later = static_cast<std::size_t>(first + 2 * batch);
    ahead.Allow(later < begins.size() ? begins[later] : pictures.size());
    ParallelFor(count, at_once, [&](std::int64_t k) {
      const int g = wanted[static_cast<std::size_t>(first + k)];
      spool.Park(g, reader.StateOf(g), reader.Read(g));
    });
  }
  Report(progress, {"reconstruct", total, total, "pictures"});
  if (options.ranks != nullptr) {
    spool.Share(*options.ranks);
  }
  for (const int g : all) {
    summary.frame_count += spool.FrameCount(g);
    summary.saturated_count += spool.SaturatedCount(g);
  }
}

// What the session's own pictures say, and what is to be warned of.
calibrate::SessionState Examine(const acquire::SessionReader& session,
                                const calibrate::Calibration& of_rig,
                                const ReconstructOptions& options,
                                ReconstructSummary& summary) {
  calibrate::SessionState state =
      calibrate::ExamineSession(session, of_rig, {}, options.thread_count);
  state.plane = Settle(state.plane);
  for (const calibrate::Warning& warning :
       calibrate::CompareAge(session, of_rig, options.max_age_days)) {
    summary.warnings.push_back(warning.name + ": " + warning.text);
  }
  for (const calibrate::Warning& warning : state.warnings) {
    summary.warnings.push_back(warning.name + ": " + warning.text);
  }
  return state;
}

}  // namespace

ReconstructSummary Reconstruct(const acquire::SessionReader& session,
                               const calibrate::Calibration& of_rig,
                               const std::filesystem::path& out,
                               const ReconstructOptions& options,
                               const ProgressFunction& progress) {
  nacre::Validate(options);
  const auto start = std::chrono::steady_clock::now();
  CheckSameRig(session, of_rig, options.incremental);
  ReconstructSummary summary;
  const calibrate::SessionState state = Examine(session, of_rig, options, summary);
  calibrate::Calibration calibration = of_rig;
  calibration.camera = of_rig.camera.OnPlane(state.plane);
  const RdHeader header = HeaderOf(session, calibration, options);
  const calibrate::SpotProfile spot = options.sharpen_spot
                                          ? internal::SpotOf(session, of_rig)
                                          : calibrate::SpotProfile{};
  summary.spot_sigma_mm = std::sqrt(std::max(0.0, 0.5 * (spot.xx_mm2 + spot.yy_mm2)));
  summary.group_count = session.schedule().group_count();
  summary.slice_count = header.PointCount();
  std::optional<RdWriter> writer;
  if (options.ranks == nullptr || options.ranks->IsRoot()) {
    writer.emplace(out, header);
  }
  const GroupReader reader(
      session, calibration, state, header, spot, options.thread_count);
  const std::filesystem::path work = WorkFile(out);
  GroupSpool spool(
      work,
      options.incremental,
      {.key = KeyOf(session, calibration, work, spot, options.ranks),
       .group_count = summary.group_count,
       .value_count = reader.lattice().CellCount() * std::ssize(header.channels),
       .channel_count = std::ssize(header.channels),
       .most_spots = static_cast<std::int64_t>(reader.MostSpots())},
      options.ranks);
  Measure(reader, options, spool, summary, progress);
  const bool looks_for_gloss =
      options.remove_gloss && options.specular_radius_cells < 0;
  const internal::Gloss gloss =
      looks_for_gloss ? internal::MeasureGloss(session, of_rig, reader, spool)
                      : internal::Gloss{};
  if (std::string text = gloss.Warning(header.channels); !text.empty()) {
    summary.warnings.push_back(std::move(text));
  }
  spool.Forget();

  Separation separation(header, session.schedule(), reader, spool, options);
  if (options.subtract_crosstalk) {
    Report(progress, {"reconstruct", 0, header.points_y, "tails"});
    separation.FitTails();
    for (int c = 0; c < static_cast<int>(std::ssize(header.channels)); ++c) {
      summary.tail_spread.push_back(static_cast<double>(separation.Spread(c)));
    }
  }
  summary.is_dense = separation.IsDense();
  spool.Forget();
  const internal::GlossRemover remover(gloss, calibration, state.plane, header, reader);
  const auto& exposures_us = session.rig().camera.exposures_us;
  const internal::ExposureAdvice advice(calibration, header, exposures_us);
  const internal::Finishing finishing{
      header,
      calibration,
      remover,
      advice,
      *std::max_element(exposures_us.begin(), exposures_us.end())};
  if (!writer) {
    internal::SendSlices(separation, finishing, options, progress);
    return summary;
  }
  internal::WriteSlices(separation, finishing, options, *writer, summary, progress);
  writer->Finish();
  RdReader written(out);
  summary.reciprocity = MeasureReciprocity(written);
  summary.seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return summary;
}

std::string ReconstructSummary::Brief() const {
  std::string text = fmt::format(
      "{} slices of {} frames in {:.1f} s; {} pixels saturated, {} values invalid, "
      "other spots' light at most {:.2g} of a slice{}; R_d(a, b) and R_d(b, a) differ "
      "by "
      "{:.2g} beyond noise",
      slice_count,
      frame_count,
      seconds,
      saturated_count,
      invalid_count,
      max_crosstalk,
      is_dense ? " (windows overlap)" : "",
      reciprocity.asymmetry);
  if (groups_reused > 0 || groups_missing > 0) {
    text +=
        fmt::format("; of {} groups of spots {} from an earlier run, {} not captured",
                    group_count,
                    groups_reused,
                    groups_missing);
  }
  if (symmetrize_change > 0) {
    text +=
        fmt::format("; averaging both changed values by {:.2g}, totals by up to {:.2g}",
                    symmetrize_change,
                    symmetrize_worst_total);
  }
  return text;
}

}  // namespace nacre::reconstruct
