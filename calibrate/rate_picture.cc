#include "calibrate/rate_picture.h"

#include "calibrate/internal/pictures.h"

#include <memory>

namespace nacre::calibrate {

void RatePictures::SetAmbient(const SmoothField& ambient, int width, int height) {
  ambient_ = AmbientMap(ambient, filters_, width, height);
}

void RatePictures::SetFlatField(const SmoothField& flat, int width, int height) {
  flat_ = flat.empty() ? std::vector<float>() : flat.Map(width, height);
}

void RatePictures::SetGlare(const Glare& glare, int width, int height) {
  glare_ =
      glare.empty() ? nullptr : std::make_unique<GlareFilter>(glare, width, height);
}

std::vector<float> RatePictures::Rates(const acquire::Frame& frame, int channel) const {
  const double level = dark_.level.Counts(frame.exposure_us);
  std::vector<float> rates;
  rates.reserve(frame.counts.size());
  for (const std::uint16_t count : frame.counts) {
    rates.push_back(
        static_cast<float>(linearity_.Linear(count - level) / frame.exposure_us));
  }
  internal::FillHotPixels(
      dark_.hot_pixels, frame.width, filters_.mosaic.empty() ? 1 : 2, rates);
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
