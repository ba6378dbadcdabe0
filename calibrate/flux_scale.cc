#include "calibrate/internal/pictures.h"
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
  int width = 0;
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
  plane.width = camera.width_px;
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
           double reach_mm,
           double core_mm)
      : width_(static_cast<std::size_t>(plane.width)), spot_count_(spots.size()) {
    for (std::size_t k = 0; k < plane.centre.size(); ++k) {
      for (std::size_t s = 0; s < spots.size(); ++s) {
        const double r =
            std::hypot(plane.centre[k].x - spots[s].x, plane.centre[k].y - spots[s].y);
        if (r <= reach_mm) {
          members_.push_back({k, s, plane.area_mm2[k], r <= core_mm});
        }
      }
    }
  }

  // Σ rate · footprint of one picture for each spot.
  std::vector<double> Of(const std::vector<float>& rates) const {
    std::vector<double> sums(spot_count_, 0.0);
    for (const Member& member : members_) {
      sums[member.spot] += static_cast<double>(rates[member.pixel]) * member.area_mm2;
    }
    return sums;
  }

  // The variance of those sums from the pixels' own noise, and from what the pixels of
  // a row have in common.
  std::vector<double> Variances(const std::vector<float>& rates,
                                double exposure_us,
                                const DarkResult& dark,
                                double gain) const {
    std::vector<double> variances(spot_count_, 0.0);
    std::vector<double> row_areas(spot_count_, 0.0);
    std::vector<std::size_t> rows(spot_count_, 0);
    const double per_us2 = 1 / (exposure_us * exposure_us);
    const double row2 = dark.row_noise_counts * dark.row_noise_counts * per_us2;
    const auto end_row = [&](std::size_t spot) {
      variances[spot] += row2 * row_areas[spot] * row_areas[spot];
      row_areas[spot] = 0;
    };
    for (const Member& member : members_) {  // row by row
      const double counts = static_cast<double>(rates[member.pixel]) * exposure_us;
      variances[member.spot] += (std::max(0.0, counts) / gain + dark.variance_counts2) *
                                member.area_mm2 * member.area_mm2 * per_us2;
      if (rows[member.spot] != member.pixel / width_) {
        end_row(member.spot);
        rows[member.spot] = member.pixel / width_;
      }
      row_areas[member.spot] += member.area_mm2;
    }
    for (std::size_t spot = 0; spot < spot_count_; ++spot) {
      end_row(spot);
    }
    return variances;
  }

  // Over how many pixels a spot's light is spread, as averages of speckle go:
  // (Σ w)² / Σ w². The mean over spots.
  double PixelsASpot(const std::vector<float>& rates) const {
    std::vector<double> sums(spot_count_, 0.0);
    std::vector<double> squares(spot_count_, 0.0);
    for (const Member& member : members_) {
      const double weight = static_cast<double>(rates[member.pixel]) * member.area_mm2;
      sums[member.spot] += weight;
      squares[member.spot] += weight * weight;
    }
    double mean = 0;
    for (std::size_t s = 0; s < spot_count_; ++s) {
      mean += sums[s] * sums[s] / squares[s] / static_cast<double>(spot_count_);
    }
    return mean;
  }

  // Second moments about each spot's own centre, less a pixel's own; their mean, and
  // the standard uncertainty of that from their scatter.
  SpotProfile Profile(const PixelPlane& plane, const std::vector<float>& rates) const {
    struct Moments {
      double w = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0, area = 0;
      int n = 0;
    };
    std::vector<Moments> moments(spot_count_);
    for (const Member& member : members_) {
      if (!member.is_core) {
        continue;
      }
      Moments& m = moments[member.spot];
      const double w = static_cast<double>(rates[member.pixel]) * member.area_mm2;
      const PointMm p = plane.centre[member.pixel];
      m.w += w;
      m.x += w * p.x;
      m.y += w * p.y;
      m.xx += w * p.x * p.x;
      m.xy += w * p.x * p.y;
      m.yy += w * p.y * p.y;
      m.area += member.area_mm2;
      ++m.n;
    }
    SpotProfile profile;
    double square = 0;
    const auto n = static_cast<double>(spot_count_);
    for (const Moments& m : moments) {
      const double x = m.x / m.w;
      const double y = m.y / m.w;
      const double pixel = m.area / m.n / 12;
      const double xx = m.xx / m.w - x * x - pixel;
      profile.xx_mm2 += xx / n;
      profile.xy_mm2 += (m.xy / m.w - x * y) / n;
      profile.yy_mm2 += (m.yy / m.w - y * y - pixel) / n;
      square += xx * xx / n;
    }
    profile.sigma_mm2 =
        std::sqrt(std::max(0.0, square - profile.xx_mm2 * profile.xx_mm2) / n);
    return profile;
  }

 private:
  struct Member {
    std::size_t pixel;
    std::size_t spot;
    double area_mm2;
    bool is_core;  // so near the spot that second moments aren't noise
  };
  std::size_t width_;
  std::size_t spot_count_;
  std::vector<Member> members_;
};

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
  std::vector<std::vector<double>> pictures;  // Σ rate · footprint of each spot
  std::vector<float> mean;                    // picture
  double noise = 0;  // relative variance of one of those sums, the sensor's own
  double exposure_us = 0;
};

double Mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) /
         static_cast<double>(values.size());
}

// The variance of spots' powers from picture to picture, relative; what all have in
// common taken off. Pictures that visit the lattice the same way round are compared:
// the others' spots lie elsewhere by the mirrors' hysteresis, and their speckle
// differs. Returns the sum over pictures and spots, and how many of them are free.
struct Scatter {
  double variance = 0;
  double freedom = 0;
};

Scatter RelativeScatter(const ChannelSums& sums, std::size_t ways) {
  Scatter scatter;
  double square = 0;
  for (std::size_t way = 0; way < ways; ++way) {
    std::vector<double> mean;
    double n = 0;
    for (std::size_t k = way; k < sums.pictures.size(); k += ways) {
      mean.resize(sums.pictures[k].size(), 0.0);
      for (std::size_t s = 0; s < mean.size(); ++s) {
        mean[s] += sums.pictures[k][s];
      }
      n += 1;
    }
    if (n < 2) {
      continue;
    }
    for (std::size_t k = way; k < sums.pictures.size(); k += ways) {
      const double all = Mean(sums.pictures[k]) / Mean(mean);
      for (std::size_t s = 0; s < mean.size(); ++s) {
        const double deviation = sums.pictures[k][s] / (all * mean[s]) - 1;
        square += deviation * deviation;
      }
    }
    scatter.freedom += (n - 1) * static_cast<double>(mean.size());
  }
  scatter.variance = scatter.freedom > 0 ? square / scatter.freedom : 0;
  return scatter;
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
    const std::vector<float> rates = pictures.Rates(frame);
    sums.exposure_us = frame.exposure_us;
    sums.mean.resize(rates.size(), 0.0F);
    for (std::size_t k = 0; k < rates.size(); ++k) {
      sums.mean[k] += rates[k];
    }
    sums.pictures.push_back(spots.Of(rates));
  }
  for (float& value : sums.mean) {
    value /= static_cast<float>(sums.pictures.size());
  }
  const std::vector<double> variances = spots.Variances(
      sums.mean, sums.exposure_us, pictures.dark(), transfer.gain_electrons_per_count);
  const std::vector<double> means = spots.Of(sums.mean);
  for (std::size_t s = 0; s < means.size(); ++s) {
    sums.noise +=
        variances[s] / (means[s] * means[s]) / static_cast<double>(means.size());
  }
  return sums;
}

// Averages over channels of what the light's noise is.
class LightNoiseSums {
 public:
  void Add(const ChannelSums& sums,
           std::size_t ways,
           double spread,
           double pixels_a_spot) {
    const auto frames = static_cast<double>(sums.pictures.size());
    const Scatter scatter = RelativeScatter(sums, ways);
    double ripple2 = 0;
    if (scatter.freedom > 0) {
      ripple2 = scatter.variance - sums.noise;
      ripple2_ += ripple2;
      ripple2_variance_ += 2 * scatter.variance * scatter.variance / scatter.freedom;
    }
    speckle2_ += (spread * spread - (sums.noise + std::max(0.0, ripple2)) / frames) *
                 pixels_a_spot * static_cast<double>(ways);
    channels_ += 1;
  }

  LightNoise Result() const {
    LightNoise noise;
    const double ripple2 = ripple2_ / channels_;
    const double sigma2 = std::sqrt(ripple2_variance_) / channels_;
    constexpr double kSignificant = 4;
    if (ripple2 > kSignificant * sigma2) {
      noise.ripple = std::sqrt(ripple2);
      noise.ripple_sigma = 0.5 * sigma2 / noise.ripple;
    }
    noise.speckle_contrast = std::sqrt(std::max(0.0, speckle2_ / channels_));
    return noise;
  }

 private:
  double ripple2_ = 0;
  double ripple2_variance_ = 0;
  double speckle2_ = 0;
  double channels_ = 0;
};

}  // namespace

FluxResult EstimateFluxScales(const acquire::SessionReader& session,
                              const CameraGeometry& camera,
                              const acquire::ScanMap& map,
                              const RatePictures& pictures,
                              const PhotonTransfer& transfer) {
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
  constexpr double kCorePx = 5;
  const double core_mm =
      kCorePx * std::sqrt(camera.FootprintMm2(camera.PixelFromSample(spots[0])));
  const SpotSums sums(plane, spots, reach_mm, core_mm);
  const std::vector<std::string>& names = session.rig().scanner.channels;
  const std::size_t ways = session.rig().targets.reverse_lattice &&
                                   session.rig().targets.reference_frames > 1
                               ? 2
                               : 1;
  FluxResult result;
  LightNoiseSums light_noise;
  for (int channel = 0; channel < std::ssize(names); ++channel) {
    const ChannelSums read = ReadChannel(session, sums, pictures, transfer, channel);
    const std::vector<double> scales = sums.Of(read.mean);
    const auto n = static_cast<double>(scales.size());
    const double mean = Mean(scales);
    if (!(mean > 0)) {
      throw BadData(fmt::format("{}: channel {} is dark on the reference target",
                                session.folder().string(),
                                names[static_cast<std::size_t>(channel)]));
    }
    double variance = 0;
    for (const double scale : scales) {
      variance += (scale - mean) * (scale - mean) / n;
    }
    const double spread = std::sqrt(variance) / mean;
    result.channels.push_back(
        {.name = names[static_cast<std::size_t>(channel)],
         .flux_scale_counts_mm2_sr_per_us =
             mean * std::numbers::pi / session.rig().targets.reference_reflectance,
         .flux_scale_spread = spread,
         .flux_scale_sigma = spread / std::sqrt(n)});
    result.spots.push_back(sums.Profile(plane, read.mean));
    light_noise.Add(read, ways, spread, sums.PixelsASpot(read.mean));
  }
  result.light_noise = light_noise.Result();
  return result;
}

}  // namespace nacre::calibrate
