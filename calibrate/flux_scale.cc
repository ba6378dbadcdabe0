#include "calibrate/radiometry.h"
#include "core/error.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numbers>
#include <numeric>

namespace nacre::calibrate {
namespace {

using acquire::Frame;

// Pixel centres and areas on the sample plane.
struct PixelPlane {
  std::vector<PointMm> centre;
  std::vector<double> area_mm2;
};

PixelPlane MapPixels(const CameraGeometry& camera) {
  // Corners are shared by four pixels: map each once.
  const int stride = camera.width_px + 1;
  std::vector<PointMm> corners;
  corners.reserve(static_cast<std::size_t>(stride) *
                  static_cast<std::size_t>(camera.height_px + 1));
  for (int y = 0; y <= camera.height_px; ++y) {
    for (int x = 0; x <= camera.width_px; ++x) {
      corners.push_back(camera.SampleFromPixel({x - 0.5, y - 0.5}));
    }
  }
  PixelPlane plane;
  for (int y = 0; y < camera.height_px; ++y) {
    for (int x = 0; x < camera.width_px; ++x) {
      const auto k = static_cast<std::size_t>(y * stride + x);
      const PointMm& a = corners[k];
      const PointMm& b = corners[k + 1];
      const PointMm& c = corners[k + static_cast<std::size_t>(stride) + 1];
      const PointMm& d = corners[k + static_cast<std::size_t>(stride)];
      plane.centre.push_back(
          {0.25 * (a.x + b.x + c.x + d.x), 0.25 * (a.y + b.y + c.y + d.y)});
      // Half the cross product of the diagonals.
      plane.area_mm2.push_back(
          0.5 * std::abs((c.x - a.x) * (d.y - b.y) - (c.y - a.y) * (d.x - b.x)));
    }
  }
  return plane;
}

// Half the distance between neighbouring spots, less a little: the disc over which a
// spot's light is summed.
double SpotReachMm(const std::vector<PointMm>& spots) {
  double closest_mm = HUGE_VAL;
  for (std::size_t a = 0; a < spots.size(); ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      closest_mm = std::min(
          closest_mm, std::hypot(spots[a].x - spots[b].x, spots[a].y - spots[b].y));
    }
  }
  return 0.49 * closest_mm;
}

// Is the disc wholly in the picture?
bool InView(const CameraGeometry& camera, PointMm centre, double radius_mm) {
  for (const auto& [dx, dy] : {std::pair(1, 0), {-1, 0}, {0, 1}, {0, -1}}) {
    const PixelPoint p =
        camera.PixelFromSample({centre.x + dx * radius_mm, centre.y + dy * radius_mm});
    if (!(p.x >= 0 && p.y >= 0 && p.x <= camera.width_px - 1 &&
          p.y <= camera.height_px - 1)) {
      return false;
    }
  }
  return true;
}

}  // namespace

std::vector<ChannelResponse> EstimateFluxScales(const acquire::SessionReader& session,
                                                const CameraGeometry& camera,
                                                const acquire::ScanMap& map,
                                                const DarkLevel& dark,
                                                double saturation_counts) {
  const PixelPlane plane = MapPixels(camera);
  std::vector<PointMm> spots;
  for (const acquire::ScanAngle& angle : session.schedule().lattice()) {
    spots.push_back(map.SampleFromAngle(angle));
  }
  const double reach_mm = SpotReachMm(spots);
  std::erase_if(spots,
                [&](const PointMm& spot) { return !InView(camera, spot, reach_mm); });
  if (spots.empty()) {
    throw BadData(session.folder().string() +
                  ": no spot of the laser lattice is wholly in view");
  }
  std::vector<ChannelResponse> channels;
  for (std::int64_t number = 0; number < session.schedule().grid_begin(); ++number) {
    const acquire::ScheduledPicture& picture = session.schedule()[number];
    if (picture.target != acquire::Target::kReference) {
      continue;
    }
    const Frame frame = session.ReadFrame(number);
    if (*std::max_element(frame.counts.begin(), frame.counts.end()) >=
        saturation_counts) {
      throw BadData(
          fmt::format("{}: the reference target is overexposed; lower "
                      "targets.reference_exposure_us",
                      (session.folder() / session.Entry(number).file).string()));
    }
    const double dark_counts = dark.Counts(frame.exposure_us);
    std::vector<double> scales(spots.size(), 0.0);
    for (std::size_t k = 0; k < frame.counts.size(); ++k) {
      for (std::size_t s = 0; s < spots.size(); ++s) {
        if (std::hypot(plane.centre[k].x - spots[s].x,
                       plane.centre[k].y - spots[s].y) <= reach_mm) {
          scales[s] +=
              (frame.counts[k] - dark_counts) / frame.exposure_us * plane.area_mm2[k];
        }
      }
    }
    const auto n = static_cast<double>(scales.size());
    const double mean = std::accumulate(scales.begin(), scales.end(), 0.0) / n;
    double variance = 0;
    for (const double scale : scales) {
      variance += (scale - mean) * (scale - mean) / n;
    }
    channels.push_back(
        {.name =
             session.rig().scanner.channels[static_cast<std::size_t>(picture.channel)],
         .flux_scale_counts_mm2_sr_per_us =
             mean * std::numbers::pi / session.rig().targets.reference_reflectance,
         .flux_scale_spread = std::sqrt(variance) / mean});
  }
  return channels;
}

}  // namespace nacre::calibrate
