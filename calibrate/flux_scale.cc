#include "calibrate/internal/light_noise.h"
#include "calibrate/internal/pictures.h"
#include "calibrate/internal/spot_sums.h"
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
using internal::SpotSums;

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

void RequireUnsaturated(const acquire::SessionReader& session,
                        std::int64_t number,
                        const Frame& frame,
                        const std::vector<bool>& hot,
                        double saturation_counts) {
  bool is_full = false;
  for (std::size_t k = 0; k < frame.counts.size(); ++k) {
    is_full =
        is_full || (frame.counts[k] >= saturation_counts && (hot.empty() || !hot[k]));
  }
  if (is_full) {
    throw BadData(fmt::format(
        "{}: the reference target is overexposed; lower targets.reference_exposure_us",
        (session.folder() / session.Entry(number).file).string()));
  }
}

// What is summed up over the pictures of a channel.
struct ChannelSums {
  internal::SpotPowers powers;
  std::vector<float> mean;  // picture
  double exposure_us = 0;
};

double Mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) /
         static_cast<double>(values.size());
}

// The pictures of one channel.
ChannelSums ReadChannel(const acquire::SessionReader& session,
                        const SpotSums& spots,
                        const RatePictures& pictures,
                        const PhotonTransfer& transfer,
                        int channel) {
  ChannelSums sums;
  for (const std::int64_t number :
       internal::PicturesOf(session, acquire::Target::kReference, channel)) {
    const Frame frame = session.ReadFrame(number);
    RequireUnsaturated(
        session,
        number,
        frame,
        internal::MaskOf(pictures.dark().hot_pixels, frame.counts.size()),
        transfer.saturation_counts);
    const std::vector<float> rates = pictures.Rates(frame, channel);
    sums.exposure_us = frame.exposure_us;
    sums.mean.resize(rates.size(), 0.0F);
    for (std::size_t k = 0; k < rates.size(); ++k) {
      sums.mean[k] += rates[k];
    }
    sums.powers.pictures.push_back(spots.Of(rates));
  }
  for (float& value : sums.mean) {
    value /= static_cast<float>(sums.powers.pictures.size());
  }
  const std::vector<double> variances = spots.Variances(
      sums.mean, sums.exposure_us, pictures.dark(), transfer.gain_electrons_per_count);
  const std::vector<double> means = spots.Of(sums.mean);
  const auto n = static_cast<double>(means.size());
  const double mean = Mean(means);
  double variance = 0;
  for (std::size_t s = 0; s < means.size(); ++s) {
    sums.powers.noise += variances[s] / (means[s] * means[s]) / n;
    variance += (means[s] - mean) * (means[s] - mean) / n;
  }
  sums.powers.spread = std::sqrt(variance) / mean;
  sums.powers.pixels_a_spot = spots.PixelsASpot(sums.mean);
  return sums;
}

// The lattice's spots that are wholly in view, and the discs around them.
struct Discs {
  std::vector<PointMm> spots;
  double reach_mm = 0;
  double core_mm = 0;
};

Discs DiscsOf(const acquire::SessionReader& session,
              const CameraGeometry& camera,
              const acquire::ScanMap& map) {
  Discs discs;
  for (const acquire::ScanAngle& angle : session.schedule().lattice()) {
    discs.spots.push_back(map.SampleFromAngle(angle));
  }
  discs.reach_mm = SpotReachMm(discs.spots);
  std::erase_if(discs.spots, [&](const PointMm& spot) {
    return !InView(camera, spot, discs.reach_mm);
  });
  if (discs.spots.empty()) {
    throw BadData(session.folder().string() +
                  ": no spot of the laser lattice is wholly in view");
  }
  constexpr double kCorePx = 5;
  discs.core_mm =
      kCorePx * std::sqrt(camera.FootprintMm2(camera.PixelFromSample(discs.spots[0])));
  return discs;
}

}  // namespace

FluxResult EstimateFluxScales(const acquire::SessionReader& session,
                              const CameraGeometry& camera,
                              const acquire::ScanMap& map,
                              const RatePictures& pictures,
                              const PhotonTransfer& transfer) {
  const internal::PixelGround ground = internal::MapPixels(camera);
  const Discs discs = DiscsOf(session, camera, map);
  const acquire::TargetsDescription& targets = session.rig().targets;
  const std::vector<std::string>& names = session.rig().scanner.channels;
  const std::size_t ways =
      targets.reverse_lattice && targets.reference_frames > 1 ? 2 : 1;
  FluxResult result;
  internal::LightNoiseSums light_noise;
  for (int channel = 0; channel < std::ssize(names); ++channel) {
    const SpotSums sums(ground,
                        pictures.Shares(channel, camera.width_px, camera.height_px),
                        discs.spots,
                        discs.reach_mm,
                        discs.core_mm);
    const ChannelSums read = ReadChannel(session, sums, pictures, transfer, channel);
    const double mean = Mean(sums.Of(read.mean));
    if (!(mean > 0)) {
      throw BadData(fmt::format("{}: channel {} is dark on the reference target",
                                session.folder().string(),
                                names[static_cast<std::size_t>(channel)]));
    }
    const double spread = read.powers.spread;
    result.channels.push_back(
        {.name = names[static_cast<std::size_t>(channel)],
         .flux_scale_counts_mm2_sr_per_us =
             mean * std::numbers::pi / targets.reference_reflectance,
         .flux_scale_spread = spread,
         .flux_scale_sigma =
             spread / std::sqrt(static_cast<double>(discs.spots.size()))});
    result.spots.push_back(sums.Profile(ground, read.mean));
    light_noise.Add(read.powers, ways);
  }
  result.light_noise = light_noise.Result();
  return result;
}

}  // namespace nacre::calibrate
