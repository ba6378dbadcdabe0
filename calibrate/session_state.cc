#include "calibrate/session_state.h"

#include "calibrate/dark.h"
#include "calibrate/hysteresis.h"
#include "calibrate/internal/pictures.h"
#include "calibrate/rate_picture.h"
#include "core/error.h"

#include <opencv2/core.hpp>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numbers>
#include <optional>

namespace nacre::calibrate {
namespace {

using acquire::Frame;

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

// The light in a disc around a point, less what the ring around it has on the average.
struct Disc {
  double sum = 0;  // of rate · footprint
  PixelPoint centre;
  bool is_whole = false;  // in view, not saturated, and there is light
};

Disc SumDisc(const Frame& frame,
             const std::vector<float>& rates,
             const Calibration& calibration,
             PixelPoint about,
             double radius_px) {
  Disc disc;
  const int reach = static_cast<int>(std::ceil(radius_px)) + 2;
  const int x0 = static_cast<int>(std::lround(about.x));
  const int y0 = static_cast<int>(std::lround(about.y));
  if (x0 < reach || y0 < reach || x0 + reach >= frame.width ||
      y0 + reach >= frame.height) {
    return disc;
  }
  std::vector<double> ring;
  double sum_x = 0;
  double sum_y = 0;
  double count = 0;
  for (int pass = 0; pass < 2; ++pass) {
    double ground = 0;
    for (const double value : ring) {
      ground += value / static_cast<double>(ring.size());
    }
    for (int y = y0 - reach; y <= y0 + reach; ++y) {
      for (int x = x0 - reach; x <= x0 + reach; ++x) {
        const auto k = static_cast<std::size_t>(y * frame.width + x);
        const double r = std::hypot(x - about.x, y - about.y);
        const auto rate = static_cast<double>(rates[k]);
        if (pass == 0 && r > radius_px && r <= radius_px + 1.5) {
          ring.push_back(rate);
        }
        if (pass == 1 && r <= radius_px) {
          if (frame.counts[k] >= calibration.saturation_counts) {
            return disc;
          }
          disc.sum += rate - ground;
          sum_x += (rate - ground) * x;
          sum_y += (rate - ground) * y;
          count += 1;
        }
      }
    }
  }
  disc.is_whole = disc.sum > 0 && count > 0;
  if (disc.is_whole) {
    disc.centre = {sum_x / disc.sum, sum_y / disc.sum};
    disc.sum *= calibration.camera.FootprintMm2(about);
  }
  return disc;
}

// The centre of gravity, moved along until it rests.
std::optional<PixelPoint> Centre(const Frame& frame,
                                 const std::vector<float>& rates,
                                 const Calibration& calibration,
                                 PixelPoint about) {
  constexpr double kRadiusPx = 3.5;  // of a peak that goes on into the sample's glow
  constexpr int kRounds = 6;
  const PixelPoint start = about;
  for (int round = 0; round < kRounds; ++round) {
    const Disc disc = SumDisc(frame, rates, calibration, about, kRadiusPx);
    if (!disc.is_whole ||
        std::hypot(disc.centre.x - start.x, disc.centre.y - start.y) > 3 * kRadiusPx) {
      return std::nullopt;
    }
    about = disc.centre;
  }
  return about;
}

// Where a beam aimed at a point of the sample plane is at a height.
PointMm BeamAt(const Calibration& calibration, PointMm point, double height_mm) {
  const acquire::ScanAngle angle = calibration.scan_map.AngleFromSample(point);
  return {point.x - height_mm * std::tan(angle.x_rad) / std::cos(angle.y_rad),
          point.y - height_mm * std::tan(angle.y_rad)};
}

// A spot that was seen, as an equation for the plane: along = height(at) to a weight.
struct Sighting {
  PointMm at;
  double height_mm = 0;  // that explains it
  double across_px = 0;  // what no height explains
  double px_per_mm = 0;
};

void AddSightings(const acquire::SessionReader& session,
                  const Calibration& calibration,
                  const Frame& frame,
                  const std::vector<float>& rates,
                  std::int64_t number,
                  std::vector<Sighting>& sightings) {
  const CameraGeometry lifted = calibration.camera.OnPlane({.height_mm = 1});
  const acquire::ScanMap& map =
      session.manifest().scan_map ? *session.manifest().scan_map : calibration.scan_map;
  const std::vector<PointMm> aims =
      BeamPositions(calibration, session.schedule().Beams(number, &map));
  // The patch, last of them, doesn't lie on the sample.
  const std::size_t count =
      session.schedule().Group(session.schedule()[number].group).size();
  for (std::size_t k = 0; k < count; ++k) {
    const PointMm aim = aims[k];
    const PixelPoint expected = calibration.camera.PixelFromSample(aim);
    const PixelPoint above = lifted.PixelFromSample(BeamAt(calibration, aim, 1));
    const double jx = above.x - expected.x;
    const double jy = above.y - expected.y;
    const double length = std::hypot(jx, jy);
    constexpr double kLeastPxPerMm = 0.05;  // camera and laser nearly in line
    const auto seen = Centre(frame, rates, calibration, expected);
    if (!seen || length < kLeastPxPerMm) {
      continue;
    }
    const double dx = seen->x - expected.x;
    const double dy = seen->y - expected.y;
    sightings.push_back({.at = aim,
                         .height_mm = (dx * jx + dy * jy) / (length * length),
                         .across_px = (dx * jy - dy * jx) / length,
                         .px_per_mm = length});
  }
}

// Least squares with outliers left out in rounds.
SamplePlane FitPlane(std::vector<Sighting> sightings, int& used) {
  SamplePlane plane;
  constexpr std::size_t kFewest = 20;
  constexpr int kRounds = 4;
  for (int round = 0; round < kRounds && sightings.size() >= kFewest; ++round) {
    cv::Matx33d normal = cv::Matx33d::zeros();
    cv::Vec3d right(0, 0, 0);
    for (const Sighting& s : sightings) {
      const cv::Vec3d row(1, s.at.x, s.at.y);
      const double weight = s.px_per_mm * s.px_per_mm;
      normal += weight * (row * row.t());
      right += weight * s.height_mm * row;
    }
    const cv::Matx33d inverse = normal.inv();
    const cv::Vec3d solution = inverse * right;
    plane = {.height_mm = solution[0], .slope_x = solution[1], .slope_y = solution[2]};
    double square = 0;
    std::vector<double> residuals;
    for (const Sighting& s : sightings) {
      const double off =
          s.px_per_mm * (s.height_mm - plane.height_mm - plane.slope_x * s.at.x -
                         plane.slope_y * s.at.y);
      residuals.push_back(std::abs(off));
      square += off * off;
    }
    const auto n = static_cast<double>(sightings.size());
    const double variance = square / (n - 3);
    plane.height_sigma_mm = std::sqrt(variance * inverse(0, 0));
    plane.slope_sigma = std::sqrt(variance * std::max(inverse(1, 1), inverse(2, 2)));
    used = static_cast<int>(n);
    std::vector<double> sorted = residuals;
    const auto middle = sorted.begin() + std::ssize(sorted) / 2;
    std::nth_element(sorted.begin(), middle, sorted.end());
    std::vector<Sighting> kept;
    for (std::size_t k = 0; k < sightings.size(); ++k) {
      constexpr double kFarOff = 4;  // medians
      if (residuals[k] <= kFarOff * *middle) {
        kept.push_back(sightings[k]);
      }
    }
    sightings = std::move(kept);
  }
  return plane;
}

struct PatchSample {
  double hours = 0;
  double flux = 0;  // relative to the flux scale
};

std::optional<PatchSample> LookAtPatch(const acquire::SessionReader& session,
                                       const Calibration& calibration,
                                       const Frame& frame,
                                       const std::vector<float>& rates,
                                       std::int64_t number) {
  const acquire::TargetsDescription& targets = session.rig().targets;
  constexpr double kRadiusPx = 4.5;
  const Disc disc = SumDisc(frame,
                            rates,
                            calibration,
                            calibration.camera.PixelFromSample(*targets.patch_mm),
                            kRadiusPx);
  if (!disc.is_whole) {
    return std::nullopt;
  }
  const auto channel = static_cast<std::size_t>(session.schedule()[number].channel);
  return PatchSample{
      .hours = static_cast<double>(session.Entry(number).timestamp_ns) / 3.6e12,
      .flux = disc.sum * std::numbers::pi / targets.patch_reflectance /
              calibration.channels[channel].flux_scale_counts_mm2_sr_per_us};
}

// The mean time of the pictures that the flux scale is from, hours.
double ReferenceHours(const acquire::SessionReader& session) {
  double sum = 0;
  const auto numbers = internal::PicturesOf(session, acquire::Target::kReference);
  for (const std::int64_t number : numbers) {
    sum += static_cast<double>(session.Entry(number).timestamp_ns) / 3.6e12;
  }
  return sum / static_cast<double>(numbers.size());
}

// flux = patch_flux (1 + drift (t − t_reference)), least squares.
void FitDrift(const acquire::SessionReader& session,
              const std::vector<PatchSample>& samples,
              SessionState& state) {
  constexpr std::size_t kFewest = 8;
  if (samples.size() < kFewest) {
    return;
  }
  const double zero = ReferenceHours(session);
  const auto n = static_cast<double>(samples.size());
  double st = 0;
  double sf = 0;
  double stt = 0;
  double stf = 0;
  for (const PatchSample& s : samples) {
    const double t = s.hours - zero;
    st += t / n;
    sf += s.flux / n;
    stt += t * t / n;
    stf += t * s.flux / n;
  }
  const double spread = stt - st * st;
  if (!(spread > 0)) {
    return;
  }
  const double slope = (stf - st * sf) / spread;
  const double offset = sf - slope * st;
  double square = 0;
  for (const PatchSample& s : samples) {
    const double off = s.flux - offset - slope * (s.hours - zero);
    square += off * off / (n - 2);
  }
  state.has_patch = true;
  state.patch_flux = offset;
  state.drift_per_hour = slope / offset;
  state.drift_sigma_per_hour = std::sqrt(square / (n * spread)) / offset;
  for (std::size_t k = 0; k < state.relative_flux.size(); ++k) {
    const auto number = static_cast<std::int64_t>(k);
    if (number >= session.schedule().grid_begin() && session.WasTaken(number)) {
      const double t =
          static_cast<double>(session.Entry(number).timestamp_ns) / 3.6e12 - zero;
      state.relative_flux[k] = 1 + state.drift_per_hour * t;
    }
  }
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
                            const ProgressFunction& progress) {
  SessionState state;
  state.relative_flux.assign(static_cast<std::size_t>(session.schedule().size()), 1.0);
  const DarkResult dark{.level = calibration.dark,
                        .hot_pixels = calibration.corrections.hot_pixels};
  RatePictures pictures(dark, calibration.corrections.linearity);
  pictures.SetAmbient(calibration.corrections.ambient,
                      calibration.camera.width_px,
                      calibration.camera.height_px);
  std::vector<Sighting> sightings;
  std::vector<PatchSample> patch;
  const std::vector<std::int64_t> numbers = ShortPictures(session);
  for (std::size_t k = 0; k < numbers.size(); ++k) {
    const Frame frame = session.ReadFrame(numbers[k]);
    const std::vector<float> rates = pictures.Rates(frame);
    AddSightings(session, calibration, frame, rates, numbers[k], sightings);
    if (session.rig().targets.patch_mm) {
      if (const auto sample =
              LookAtPatch(session, calibration, frame, rates, numbers[k])) {
        patch.push_back(*sample);
      }
    }
    Report(progress,
           {.stage = "session",
            .done = static_cast<std::int64_t>(k) + 1,
            .total = std::ssize(numbers),
            .note = "sample"});
  }
  double across_px = 0;
  for (const Sighting& s : sightings) {
    across_px += s.across_px / static_cast<double>(sightings.size());
  }
  state.plane = FitPlane(std::move(sightings), state.spots_used);
  FitDrift(session, patch, state);
  Warn(state, across_px, state.warnings);
  return state;
}

PointMm OnSurface(const Calibration& calibration,
                  const SamplePlane& plane,
                  PointMm point) {
  PointMm hit = point;
  double height_mm = 0;
  constexpr int kRounds =
      6;  // each gains the product of the beam's and surface's slope
  for (int round = 0; round < kRounds; ++round) {
    height_mm = plane.height_mm + plane.slope_x * hit.x + plane.slope_y * hit.y;
    hit = BeamAt(calibration, point, height_mm);
  }
  // Along the plane's own axes, as in OnPlane.
  const double a = plane.slope_x;
  const double b = plane.slope_y;
  const double along = std::sqrt(1 + a * a);
  const double across = std::sqrt((1 + a * a) * (1 + a * a + b * b));
  const double up = height_mm - plane.height_mm;
  return {(hit.x + a * up) / along,
          (-a * b * hit.x + (1 + a * a) * hit.y + b * up) / across};
}

}  // namespace nacre::calibrate
