#include "calibrate/rate_picture.h"

#include "calibrate/internal/pictures.h"

#include <algorithm>
#include <cmath>
#include <memory>

namespace nacre::calibrate {

void RatePictures::SetAmbient(const SmoothField& ambient, int width, int height) {
  ambient_ = AmbientMap(ambient, filters_, width, height);
}

void RatePictures::SetFlatField(const SmoothField& flat, int width, int height) {
  flat_ = flat.empty() ? std::vector<float>() : flat.Map(width, height);
}

void RatePictures::SetGlare(const Glare& glare, int width, int height) {
  kept_ = 1 - glare.fraction;
  // Within the spot's own skirt and beyond the picture's rim glare isn't seen: on the
  // twins a spot comes out wrong by a twentieth of it.
  constexpr double kUnseen = 0.05;
  glare_sigma_ = std::hypot(glare.fraction_sigma, kUnseen * glare.fraction);
  glare_ =
      glare.empty() ? nullptr : std::make_unique<GlareFilter>(glare, width, height);
}

std::vector<double> RatePictures::Variances(const std::vector<float>& rates,
                                            const Lighting& lighting,
                                            double gain_electrons_per_count) const {
  std::vector<float> behind_lens = rates;
  for (std::size_t k = 0; k < flat_.size(); ++k) {
    behind_lens[k] *= flat_[k];
  }
  const std::vector<float> scattered =
      glare_ ? glare_->Scattered(behind_lens) : std::vector<float>();
  // What each pixel sees of the laser, relative to the colour that sees most.
  std::vector<float> shares;
  if (!filters_.mosaic.empty()) {
    shares.assign(rates.size(), 1.0F);
    ScaleColours(filters_.mosaic,
                 filters_.lasers.at(static_cast<std::size_t>(lighting.channel)),
                 lighting.width_px,
                 shares);
  }
  std::vector<double> variances;
  variances.reserve(rates.size());
  for (std::size_t k = 0; k < rates.size(); ++k) {
    double seen = kept_ * static_cast<double>(behind_lens[k]);
    seen += scattered.empty() ? 0 : static_cast<double>(scattered[k]);
    seen += ambient_.empty() ? 0 : static_cast<double>(ambient_[k]);
    const double counts = std::max(0.0, seen * lighting.exposure_us);
    const double share = shares.empty() ? 1 : static_cast<double>(shares[k]);
    const double stretch = 1 / (lighting.exposure_us * share * kept_ *
                                (flat_.empty() ? 1 : static_cast<double>(flat_[k])));
    variances.push_back(
        (share * counts / gain_electrons_per_count + dark_.variance_counts2) * stretch *
        stretch);
  }
  return variances;
}

std::vector<float> RatePictures::Rates(const acquire::Frame& frame, int channel) const {
  const double level = dark_.level.Counts(frame.exposure_us);
  std::vector<float> rates(frame.counts.size());
  for (std::size_t k = 0; k < rates.size(); ++k) {
    rates[k] = static_cast<float>(linearity_.Linear(frame.counts[k] - level) /
                                  frame.exposure_us);
  }
  // Of a hot pixel that is cool in so short an exposure, the dark current is taken off:
  // what a spot's neighbours saw would be far worse.
  std::vector<HotPixel> spoilt;
  for (const HotPixel& pixel : dark_.hot_pixels) {
    constexpr double kHarmlessCounts = 4;
    if (pixel.rate_counts_per_us * frame.exposure_us > kHarmlessCounts) {
      spoilt.push_back(pixel);
    } else {
      rates[static_cast<std::size_t>(pixel.index)] -=
          static_cast<float>(pixel.rate_counts_per_us);
    }
  }
  internal::FillHotPixels(spoilt, frame.width, filters_.mosaic.empty() ? 1 : 2, rates);
  for (std::size_t k = 0; k < ambient_.size(); ++k) {
    rates[k] -= ambient_[k];
  }
  FillIn(filters_, channel, frame.width, rates);
  if (glare_) {
    glare_->Remove(rates);
  }
  for (std::size_t k = 0; k < flat_.size(); ++k) {
    rates[k] /= flat_[k];
  }
  return rates;
}

}  // namespace nacre::calibrate
