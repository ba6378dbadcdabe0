#include "calibrate/session_state.h"

#include "acquire/read_ahead.h"
#include "calibrate/dark.h"
#include "calibrate/internal/power_drift.h"
#include "calibrate/internal/sample_plane.h"
#include "calibrate/rate_picture.h"
#include "core/error.h"
#include "core/parallel.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numbers>
#include <optional>
#include <utility>

namespace nacre::calibrate {
namespace {

// So many pictures tell enough.
constexpr std::int64_t kMostPictures = 180;

// Sample pictures of the shortest exposure, evenly over the session.
std::vector<std::int64_t> ShortPictures(const acquire::SessionReader& session) {
  const acquire::Schedule& schedule = session.schedule();
  const double shortest_us = session.rig().camera.exposures_us.back();
  std::vector<std::int64_t> all;
  for (std::int64_t k = schedule.grid_begin(); k < session.picture_count(); ++k) {
    if (schedule[k].target == acquire::Target::kSample && session.WasTaken(k) &&
        schedule[k].exposure_us <= shortest_us) {
      all.push_back(k);
    }
  }
  const auto step =
      std::max<std::int64_t>(1, (std::ssize(all) + kMostPictures - 1) / kMostPictures);
  // A step that shares no factor with the channels sees all of them.
  std::vector<std::int64_t> some;
  for (std::int64_t k = 0; k < std::ssize(all); ++k) {
    if (k % step == (k / step) % step) {
      some.push_back(all[static_cast<std::size_t>(k)]);
    }
  }
  return some;
}

double PixelMm(const Calibration& calibration) {
  const CameraGeometry& camera = calibration.camera;
  return std::sqrt(
      camera.FootprintMm2({0.5 * camera.width_px, 0.5 * camera.height_px}));
}

void Warn(const SessionState& state, double across_px, std::vector<Warning>& warnings) {
  if (state.has_patch &&
      std::abs(state.drift_per_hour) > 4 * state.drift_sigma_per_hour &&
      std::abs(state.relative_flux.back() - 1) > 0.001) {
    warnings.push_back(
        {"power-drift",
         fmt::format(
             "the laser's power drifts by {:.2f} +- {:.2f} % an hour, {:.2f} % by "
             "the session's end; corrected",
             100 * state.drift_per_hour,
             100 * state.drift_sigma_per_hour,
             100 * (state.relative_flux.back() - 1))});
  }
  constexpr double kPatchOff = 0.15;
  if (state.has_patch && std::abs(state.patch_flux - 1) > kPatchOff) {
    warnings.push_back(
        {"patch-disagrees",
         fmt::format("the patch in view says the flux is {:.3f} of what the reference "
                     "says; is patch_reflectance right?",
                     state.patch_flux)});
  }
  const SamplePlane& p = state.plane;
  if (state.spots_used > 0 &&
      (std::abs(p.height_mm) > std::max(0.05, 4 * p.height_sigma_mm) ||
       std::hypot(p.slope_x, p.slope_y) > std::max(0.003, 4 * p.slope_sigma))) {
    warnings.push_back(
        {"sample-askew",
         fmt::format(
             "the sample's surface lies {:.3f} +- {:.3f} mm above the sample "
             "plane, tilted by {:.2f} degrees; corrected",
             p.height_mm,
             p.height_sigma_mm,
             std::atan(std::hypot(p.slope_x, p.slope_y)) * 180 / std::numbers::pi)});
  }
  constexpr double kAcross = 0.3;
  if (std::abs(across_px) > kAcross) {
    warnings.push_back(
        {"stale-geometry",
         fmt::format("spots on the sample are {:.2f} pixels aside of where they should "
                     "be, which no height explains: camera or laser have moved",
                     across_px)});
  }
}

}  // namespace

SessionState ExamineSession(const acquire::SessionReader& session,
                            const Calibration& calibration,
                            const ProgressFunction& progress,
                            int thread_count) {
  SessionState state;
  state.relative_flux.assign(static_cast<std::size_t>(session.schedule().size()), 1.0);
  const DarkResult dark{.level = calibration.dark,
                        .hot_pixels = calibration.corrections.hot_pixels};
  RatePictures pictures(
      dark, calibration.corrections.linearity, calibration.corrections.filters);
  pictures.SetAmbient(calibration.corrections.ambient,
                      calibration.camera.width_px,
                      calibration.camera.height_px);
  pictures.SetFlatField(calibration.corrections.flat_field,
                        calibration.camera.width_px,
                        calibration.camera.height_px);
  std::vector<internal::Sighting> sightings;
  std::vector<internal::PatchSample> patch;
  const std::vector<std::int64_t> numbers = ShortPictures(session);
  acquire::ReadAhead ahead(session, numbers);
  ahead.Allow(numbers.size());
  std::vector<std::vector<internal::Sighting>> seen(numbers.size());
  std::vector<std::optional<internal::PatchSample>> patches(numbers.size());
  constexpr std::int64_t kAtOnce = 16;
  for (std::int64_t begin = 0; begin < std::ssize(numbers); begin += kAtOnce) {
    const std::int64_t count = std::min(kAtOnce, std::ssize(numbers) - begin);
    ParallelFor(count, thread_count, [&](std::int64_t n) {
      const auto k = static_cast<std::size_t>(begin + n);
      const acquire::Frame frame = session.ReadFrame(numbers[k]);
      const std::vector<float> rates =
          pictures.Rates(frame, session.schedule()[numbers[k]].channel);
      internal::AddSightings(session, calibration, frame, rates, numbers[k], seen[k]);
      if (session.rig().targets.patch_mm) {
        patches[k] =
            internal::LookAtPatch(session, calibration, frame, rates, numbers[k]);
      }
    });
    Report(progress,
           {.stage = "session",
            .done = begin + count,
            .total = std::ssize(numbers),
            .note = "sample"});
  }
  for (std::size_t k = 0; k < numbers.size(); ++k) {
    sightings.insert(sightings.end(), seen[k].begin(), seen[k].end());
    if (patches[k]) {
      patch.push_back(*patches[k]);
    }
  }
  double across_px = 0;
  for (const internal::Sighting& s : sightings) {
    across_px += s.across_px / static_cast<double>(sightings.size());
  }
  double slope = 0;  // between beams and lines of sight, the mean
  for (const internal::Sighting& s : sightings) {
    slope += s.px_per_mm * PixelMm(calibration) / static_cast<double>(sightings.size());
  }
  state.plane = internal::FitPlane(std::move(sightings), state.spots_used);
  // A camera that leans otherwise than it was calibrated to sees every shift as another
  // height; how it leans is known as well as its principal point is.
  const CameraGeometry& camera = calibration.camera;
  state.plane.height_sigma_mm =
      std::hypot(state.plane.height_sigma_mm,
                 state.plane.height_mm * calibration.centre_sigma_px / camera.fx_px /
                     std::max(slope, 1e-3));
  internal::FitDrift(session, patch, state);
  Warn(state, across_px, state.warnings);
  return state;
}

}  // namespace nacre::calibrate
