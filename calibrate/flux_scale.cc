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

// The disc over which a spot's light is summed: wide enough for the skirts of any spot
// that the lattice keeps apart, and no wider, since each pixel adds its read noise.
double SpotReachMm(const std::vector<PointMm>& spots) {
  double closest_mm = HUGE_VAL;
  for (std::size_t a = 0; a < spots.size(); ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      closest_mm = std::min(
          closest_mm, std::hypot(spots[a].x - spots[b].x, spots[a].y - spots[b].y));
    }
  }
  return 0.35 * closest_mm;
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

// Which pixels count towards which spot.
class SpotSums {
 public:
  SpotSums(const PixelPlane& plane,
           const std::vector<PointMm>& spots,
           double reach_mm) {
    for (std::size_t k = 0; k < plane.centre.size(); ++k) {
      for (std::size_t s = 0; s < spots.size(); ++s) {
        if (std::hypot(plane.centre[k].x - spots[s].x,
                       plane.centre[k].y - spots[s].y) <= reach_mm) {
          members_.push_back({k, s, plane.area_mm2[k]});
        }
      }
    }
  }

  // Adds Σ rate · footprint of one picture to each spot's sum.
  void Add(const Frame& frame, double dark_counts, std::vector<double>& sums) const {
    for (const Member& member : members_) {
      sums[member.spot] += (frame.counts[member.pixel] - dark_counts) /
                           frame.exposure_us * member.area_mm2;
    }
  }

 private:
  struct Member {
    std::size_t pixel;
    std::size_t spot;
    double area_mm2;
  };
  std::vector<Member> members_;
};

std::vector<std::int64_t> ReferencePictures(const acquire::SessionReader& session,
                                            int channel) {
  std::vector<std::int64_t> numbers;
  for (std::int64_t k = 0; k < session.schedule().grid_begin(); ++k) {
    if (session.schedule()[k].target == acquire::Target::kReference &&
        session.schedule()[k].channel == channel) {
      numbers.push_back(k);
    }
  }
  return numbers;
}

void RequireUnsaturated(const acquire::SessionReader& session,
                        std::int64_t number,
                        const Frame& frame,
                        double saturation_counts) {
  if (*std::max_element(frame.counts.begin(), frame.counts.end()) >=
      saturation_counts) {
    throw BadData(fmt::format(
        "{}: the reference target is overexposed; lower targets.reference_exposure_us",
        (session.folder() / session.Entry(number).file).string()));
  }
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
  const SpotSums sums(plane, spots, reach_mm);
  const std::vector<std::string>& names = session.rig().scanner.channels;
  std::vector<ChannelResponse> channels;
  for (int channel = 0; channel < std::ssize(names); ++channel) {
    std::vector<double> scales(spots.size(), 0.0);
    for (const std::int64_t number : ReferencePictures(session, channel)) {
      const Frame frame = session.ReadFrame(number);
      RequireUnsaturated(session, number, frame, saturation_counts);
      sums.Add(frame, dark.Counts(frame.exposure_us), scales);
    }
    const auto n = static_cast<double>(scales.size());
    const double mean = std::accumulate(scales.begin(), scales.end(), 0.0) / n;
    if (!(mean > 0)) {
      throw BadData(fmt::format("{}: channel {} is dark on the reference target",
                                session.folder().string(),
                                names[static_cast<std::size_t>(channel)]));
    }
    double variance = 0;
    for (const double scale : scales) {
      variance += (scale - mean) * (scale - mean) / n;
    }
    const double frame_count = session.rig().targets.reference_frames;
    channels.push_back(
        {.name = names[static_cast<std::size_t>(channel)],
         .flux_scale_counts_mm2_sr_per_us = mean / frame_count * std::numbers::pi /
                                            session.rig().targets.reference_reflectance,
         .flux_scale_spread = std::sqrt(variance) / mean});
  }
  return channels;
}

}  // namespace nacre::calibrate
