#include "calibrate/internal/sample_plane.h"

#include "calibrate/hysteresis.h"
#include "calibrate/internal/disc_sum.h"
#include "calibrate/session_state.h"

#include <opencv2/core.hpp>

#include <algorithm>
#include <cmath>

namespace nacre::calibrate {
namespace {

// How far a beam aimed at a point of the sample plane goes aside, a mm of height.
PointMm BeamSlope(const Calibration& calibration, PointMm point) {
  const acquire::ScanAngle angle = calibration.scan_map.AngleFromSample(point);
  return {-std::tan(angle.x_rad) / std::cos(angle.y_rad), -std::tan(angle.y_rad)};
}

}  // namespace

namespace internal {

void AddSightings(const acquire::SessionReader& session,
                  const Calibration& calibration,
                  const acquire::Frame& frame,
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
    const PointMm slope = BeamSlope(calibration, aim);
    const PixelPoint above = lifted.PixelFromSample({aim.x + slope.x, aim.y + slope.y});
    const double jx = above.x - expected.x;
    const double jy = above.y - expected.y;
    const double length = std::hypot(jx, jy);
    constexpr double kLeastPxPerMm = 0.05;  // camera and laser nearly in line
    const auto seen = PeakCentre(frame, rates, calibration, expected);
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

}  // namespace internal

PointMm OnSurface(const Calibration& calibration,
                  const SamplePlane& plane,
                  PointMm point) {
  const PointMm slope = BeamSlope(calibration, point);
  PointMm hit = point;
  double height_mm = 0;
  constexpr int kRounds =
      6;  // each gains the product of the beam's and surface's slope
  for (int round = 0; round < kRounds; ++round) {
    height_mm = plane.height_mm + plane.slope_x * hit.x + plane.slope_y * hit.y;
    hit = {point.x + height_mm * slope.x, point.y + height_mm * slope.y};
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
