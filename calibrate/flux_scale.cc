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

double ClosestMm(const std::vector<PointMm>& spots) {
  double closest_mm = HUGE_VAL;
  for (std::size_t a = 0; a < spots.size(); ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      closest_mm = std::min(
          closest_mm, std::hypot(spots[a].x - spots[b].x, spots[a].y - spots[b].y));
    }
  }
  return closest_mm;
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
  std::vector<float> mean;     // picture
  std::vector<float> one_way;  // of those that visit the lattice in its order
  double exposure_us = 0;
};

double Mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) /
         static_cast<double>(values.size());
}

void AddTo(std::vector<float>& sum, const std::vector<float>& rates) {
  sum.resize(rates.size(), 0.0F);
  for (std::size_t k = 0; k < rates.size(); ++k) {
    sum[k] += rates[k];
  }
}

// The pictures of one channel.
ChannelSums ReadChannel(const acquire::SessionReader& session,
                        const SpotSums& spots,
                        const RatePictures& pictures,
                        const PhotonTransfer& transfer,
                        int channel) {
  ChannelSums sums;
  const bool reversed = session.rig().targets.reverse_lattice;
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
    AddTo(sums.mean, rates);
    // The mirrors' hysteresis moves the spots between the two ways round.
    if (!reversed || session.schedule()[number].repeat % 2 == 0) {
      AddTo(sums.one_way, rates);
    }
    sums.powers.pictures.push_back(spots.Of(rates));
  }
  for (float& value : sums.mean) {
    value /= static_cast<float>(sums.powers.pictures.size());
  }
  const int width = session.manifest().camera.width;
  const double row = pictures.dark().row_noise_counts / sums.exposure_us;
  const std::vector<double> variances = spots.Variances(
      pictures.Variances(
          sums.mean,
          {.channel = channel, .exposure_us = sums.exposure_us, .width_px = width},
          transfer.gain_electrons_per_count),
      row * row);
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
  double pixel_mm = 0;
};

// A spot between the pixels of one colour is seen brighter or darker than it is: a sum
// over every second pixel varies by 2 m cos(π x) along each axis, m what spot and pixel
// leave of half a cycle a pixel. Planes whose pixels lie a pixel apart undo each
// other's share of it.
double SamplingVariance(const std::vector<PlaneShare>& planes,
                        const SpotProfile& spot,
                        double pixel_mm) {
  const double sigma2_px2 = 0.5 * (spot.xx_mm2 + spot.yy_mm2) / (pixel_mm * pixel_mm);
  const double pi = std::numbers::pi;
  const double m = 2 / pi * std::exp(-0.5 * pi * pi * sigma2_px2);
  double along_x = 0;
  double along_y = 0;
  double both = 0;
  for (const PlaneShare& share : planes) {
    if (share.plane.step == 1) {
      return 0;
    }
    const double x = share.plane.column == 0 ? 1 : -1;
    const double y = share.plane.row == 0 ? 1 : -1;
    along_x += share.weight * x;
    along_y += share.weight * y;
    both += share.weight * x * y;
  }
  return 2 * m * m * (along_x * along_x + along_y * along_y) +
         4 * m * m * m * m * both * both;
}

Discs DiscsOf(const acquire::SessionReader& session,
              const CameraGeometry& camera,
              const acquire::ScanMap& map,
              double spot_sigma_mm) {
  Discs discs;
  for (const acquire::ScanAngle& angle : session.schedule().lattice()) {
    discs.spots.push_back(map.SampleFromAngle(angle));
  }
  const double closest_mm = ClosestMm(discs.spots);
  constexpr double kUsual = 0.35;  // wide enough for the skirts of most spots
  constexpr double kMost = 0.49;   // discs hardly touch
  constexpr double kWholeSpot = 4.5;
  discs.reach_mm =
      std::clamp(kWholeSpot * spot_sigma_mm, kUsual * closest_mm, kMost * closest_mm);
  std::erase_if(discs.spots, [&](const PointMm& spot) {
    return !InView(camera, spot, discs.reach_mm);
  });
  if (discs.spots.empty()) {
    throw BadData(session.folder().string() +
                  ": no spot of the laser lattice is wholly in view");
  }
  constexpr double kCorePx = 5;
  discs.pixel_mm =
      std::sqrt(camera.FootprintMm2(camera.PixelFromSample(discs.spots[0])));
  discs.core_mm = std::min(
      std::max(kWholeSpot * spot_sigma_mm, kCorePx * discs.pixel_mm), discs.reach_mm);
  return discs;
}

// Standard uncertainty of a channel's scale, relative: the spots' scatter, and what all
// spots share of the dark's, the response's and the glare's.
double FluxSigma(const RatePictures& pictures,
                 const PhotonTransfer& transfer,
                 const ChannelSums& sums,
                 const Discs& discs,
                 double mean) {
  const auto n = static_cast<double>(discs.spots.size());
  const double area_mm2 = std::numbers::pi * discs.reach_mm * discs.reach_mm;
  const DarkLevel& dark = pictures.dark().level;
  const double dark_rate = std::hypot(dark.offset_sigma_counts / sums.exposure_us,
                                      dark.rate_sigma_counts_per_us);
  const float brightest = *std::max_element(sums.mean.begin(), sums.mean.end());
  const double bent = pictures.linearity().sigma_at_saturation *
                      static_cast<double>(brightest) * sums.exposure_us /
                      transfer.saturation_counts;
  return std::hypot(std::hypot(sums.powers.spread / std::sqrt(n), bent),
                    std::hypot(pictures.glare_sigma(), dark_rate * area_mm2 / mean));
}

}  // namespace

double SpotSigmaMm(const acquire::SessionReader& session,
                   const CameraGeometry& camera,
                   const acquire::ScanMap& map,
                   const RatePictures& pictures) {
  const internal::PixelGround ground = internal::MapPixels(camera);
  const Discs discs = DiscsOf(session, camera, map, 0);
  double widest_mm = 0;
  for (int channel = 0; channel < session.rig().ChannelCount(); ++channel) {
    const SpotSums sums(ground,
                        pictures.Shares(channel, camera.width_px, camera.height_px),
                        discs.spots,
                        discs.reach_mm,
                        discs.core_mm);
    const Frame frame = session.ReadFrame(
        internal::PicturesOf(session, acquire::Target::kReference, channel).front());
    constexpr double kWithinRoot2Sigma = 0.632;
    widest_mm = std::max(
        widest_mm,
        sums.RadiusMm(
            ground, discs.spots, pictures.Rates(frame, channel), kWithinRoot2Sigma) /
            std::numbers::sqrt2);
  }
  return widest_mm;
}

FluxResult EstimateFluxScales(const acquire::SessionReader& session,
                              const CameraGeometry& camera,
                              const acquire::ScanMap& map,
                              const RatePictures& pictures,
                              const PhotonTransfer& transfer) {
  const internal::PixelGround ground = internal::MapPixels(camera);
  const Discs discs =
      DiscsOf(session, camera, map, SpotSigmaMm(session, camera, map, pictures));
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
    ChannelSums read = ReadChannel(session, sums, pictures, transfer, channel);
    const double mean = Mean(sums.Of(read.mean));
    if (!(mean > 0)) {
      throw BadData(fmt::format("{}: channel {} is dark on the reference target",
                                session.folder().string(),
                                names[static_cast<std::size_t>(channel)]));
    }
    result.channels.push_back(
        {.name = names[static_cast<std::size_t>(channel)],
         .flux_scale_counts_mm2_sr_per_us =
             mean * std::numbers::pi / targets.reference_reflectance,
         .flux_scale_spread = read.powers.spread,
         .flux_scale_sigma = FluxSigma(pictures, transfer, read, discs, mean)});
    result.spots.push_back(sums.Profile(ground, read.one_way));
    read.powers.sampling =
        SamplingVariance(pictures.Planes(channel), result.spots.back(), discs.pixel_mm);
    light_noise.Add(read.powers, ways);
  }
  result.light_noise = light_noise.Result();
  return result;
}

}  // namespace nacre::calibrate
