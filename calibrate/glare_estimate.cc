#include "calibrate/glare_estimate.h"

#include "calibrate/internal/pictures.h"
#include "core/error.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace nacre::calibrate {
namespace {

using acquire::Frame;
using acquire::Target;

// Which pixels of a frame may be believed: neither saturated nor in a column that has a
// saturated pixel, or beside one.
std::vector<bool> Believable(const Frame& frame, double saturation_counts) {
  std::vector<bool> column_spills(static_cast<std::size_t>(frame.width), false);
  const auto width = static_cast<std::size_t>(frame.width);
  for (std::size_t k = 0; k < frame.counts.size(); ++k) {
    if (frame.counts[k] >= saturation_counts) {
      const std::size_t x = k % width;
      for (std::size_t beside = x > 0 ? x - 1 : 0; beside <= std::min(x + 1, width - 1);
           ++beside) {
        column_spills[beside] = true;
      }
    }
  }
  std::vector<bool> good(frame.counts.size());
  for (std::size_t k = 0; k < good.size(); ++k) {
    good[k] = !column_spills[k % width];
  }
  return good;
}

struct Ring {
  double weight = 0;
  double sum = 0;
  double square = 0;
  double radius = 0;
};

// Rings grow by that factor, from `beyond_px` on.
constexpr double kGrowth = 1.3;

// The merged picture of one channel.
struct Merged {
  std::vector<double> rates;
  std::vector<double> exposures;  // 0: no exposure may be believed
  int width = 0;
};

Merged Merge(const acquire::SessionReader& session,
             const RatePictures& pictures,
             int channel,
             double saturation_counts) {
  Merged merged;
  for (const std::int64_t number :
       internal::PicturesOf(session, Target::kGlare, channel)) {
    const Frame frame = session.ReadFrame(number);
    const std::vector<float> rates = pictures.Rates(frame, channel);
    const std::vector<bool> good = Believable(frame, saturation_counts);
    merged.width = frame.width;
    merged.rates.resize(rates.size(), 0.0);
    merged.exposures.resize(rates.size(), 0.0);
    for (std::size_t k = 0; k < rates.size(); ++k) {
      if (good[k] && frame.exposure_us > merged.exposures[k]) {
        merged.rates[k] = static_cast<double>(rates[k]);
        merged.exposures[k] = frame.exposure_us;
      }
    }
  }
  return merged;
}

double DistancePx(std::size_t k, int width, PixelPoint centre) {
  const std::size_t column = k % static_cast<std::size_t>(width);
  const std::size_t row = k / static_cast<std::size_t>(width);
  return std::hypot(static_cast<double>(column) - centre.x,
                    static_cast<double>(row) - centre.y);
}

// How far beyond a saturated pixel an exposure shows more than a shorter one says.
Blooming FindBlooming(const acquire::SessionReader& session,
                      const RatePictures& pictures,
                      const Merged& merged,
                      int channel,
                      double saturation_counts) {
  Blooming blooming;
  for (const std::int64_t number :
       internal::PicturesOf(session, Target::kGlare, channel)) {
    const Frame frame = session.ReadFrame(number);
    const std::vector<float> rates = pictures.Rates(frame, channel);
    const auto width = static_cast<std::size_t>(frame.width);
    constexpr double kFarOff = 6;
    const double variance = pictures.dark().variance_counts2;
    const auto is_swollen = [&](std::size_t k) {
      const double expected = merged.rates[k];
      // What is expected is a shorter exposure's, and as noisy; a count is an electron
      // at least.
      const double t = std::max(merged.exposures[k], 1e-9);
      const double noise = std::sqrt(variance + std::max(0.0, expected) * t) / t;
      return merged.exposures[k] > 0 &&
             frame.counts[k]<saturation_counts&& static_cast<double>(rates[k]) -
                             expected>
                         kFarOff *
                     noise +
                 0.25 * std::abs(expected);
    };
    for (std::size_t k = 0; k < rates.size(); ++k) {
      if (frame.counts[k] < saturation_counts) {
        continue;
      }
      int reach = 0;
      for (std::size_t up = k; up >= width && is_swollen(up - width); up -= width) {
        ++reach;
      }
      blooming.reach_px = std::max(blooming.reach_px, reach);
      reach = 0;
      for (std::size_t right = k; (right + 1) % width != 0 && is_swollen(right + 1);
           ++right) {
        ++reach;
      }
      blooming.side_reach_px = std::max(blooming.side_reach_px, reach);
    }
  }
  return blooming;
}

// Adds the rings of a channel, relative to all its light.
void AddRings(const Merged& merged,
              PixelPoint centre,
              double beyond_px,
              const std::vector<bool>& hot,
              std::vector<Ring>& rings) {
  double total = 0;
  for (const double rate : merged.rates) {
    total += rate;
  }
  if (!(total > 0)) {
    return;
  }
  for (std::size_t k = 0; k < merged.rates.size(); ++k) {
    const double r = DistancePx(k, merged.width, centre);
    if (r < beyond_px || !(merged.exposures[k] > 0) || (!hot.empty() && hot[k])) {
      continue;
    }
    const auto ring =
        static_cast<std::size_t>(std::log(r / beyond_px) / std::log(kGrowth));
    if (ring >= rings.size()) {
      rings.resize(ring + 1);
    }
    const double density = merged.rates[k] / total;
    const double weight = merged.exposures[k];
    rings[ring].weight += weight;
    rings[ring].sum += weight * density;
    rings[ring].square += weight * weight;
    rings[ring].radius += weight * std::log(r);
  }
}

// Of a ring's mean: from the scatter of its pixels, channel by channel the same.
std::vector<double> RingVariances(const std::vector<Merged>& channels,
                                  const std::vector<Ring>& rings,
                                  PixelPoint centre,
                                  double beyond_px) {
  std::vector<double> squares(rings.size(), 0.0);
  for (const Merged& merged : channels) {
    double total = 0;
    for (const double rate : merged.rates) {
      total += rate;
    }
    for (std::size_t k = 0; k < merged.rates.size(); ++k) {
      const double r = DistancePx(k, merged.width, centre);
      if (r < beyond_px || !(merged.exposures[k] > 0)) {
        continue;
      }
      const auto ring =
          static_cast<std::size_t>(std::log(r / beyond_px) / std::log(kGrowth));
      const Ring& of = rings[ring];
      const double deviation = merged.rates[k] / total - of.sum / of.weight;
      const double weight = merged.exposures[k] / of.weight;
      squares[ring] += weight * weight * deviation * deviation;
    }
  }
  return squares;
}

}  // namespace

GlareResult EstimateGlare(const acquire::SessionReader& session,
                          const RatePictures& pictures,
                          PixelPoint spot_px,
                          double saturation_counts,
                          double beyond_px) {
  GlareResult result;
  std::vector<Merged> channels;
  std::vector<Ring> rings;
  for (int channel = 0; channel < session.rig().ChannelCount(); ++channel) {
    if (internal::PicturesOf(session, Target::kGlare, channel).empty()) {
      return result;
    }
    channels.push_back(Merge(session, pictures, channel, saturation_counts));
    const Merged& merged = channels.back();
    AddRings(merged,
             spot_px,
             beyond_px,
             internal::MaskOf(pictures.dark().hot_pixels, merged.rates.size()),
             rings);
    const Blooming blooming =
        FindBlooming(session, pictures, merged, channel, saturation_counts);
    result.blooming.reach_px = std::max(result.blooming.reach_px, blooming.reach_px);
    result.blooming.side_reach_px =
        std::max(result.blooming.side_reach_px, blooming.side_reach_px);
  }
  const std::vector<double> variances =
      RingVariances(channels, rings, spot_px, beyond_px);
  Glare glare;
  double fraction_variance = 0;
  for (std::size_t k = 0; k < rings.size(); ++k) {
    const Ring& ring = rings[k];
    if (!(ring.weight > 0)) {
      continue;
    }
    const double density = ring.sum / ring.weight;
    const double sigma = std::sqrt(variances[k]);
    constexpr double kSignificant = 3;
    if (!(density > kSignificant * sigma)) {
      break;  // farther out there is less still
    }
    const double inner = beyond_px * std::pow(kGrowth, static_cast<double>(k));
    const double area = std::numbers::pi * inner * inner * (kGrowth * kGrowth - 1);
    glare.radius_px.push_back(k == 0 ? beyond_px : std::exp(ring.radius / ring.weight));
    glare.density_per_px2.push_back(density);
    glare.sigma_per_px2.push_back(sigma);
    const double inside = k == 0 ? std::numbers::pi * inner * inner : 0;
    glare.fraction += (area + inside) * density;
    fraction_variance += std::pow((area + inside) * sigma, 2);
  }
  glare.fraction_sigma = std::sqrt(fraction_variance);
  constexpr std::size_t kFewest = 3;
  if (glare.radius_px.size() >= kFewest) {
    result.glare = glare;
  }
  return result;
}

}  // namespace nacre::calibrate
