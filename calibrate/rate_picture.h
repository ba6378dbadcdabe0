#pragma once

#include "acquire/session.h"
#include "calibrate/dark.h"
#include "calibrate/glare.h"
#include "calibrate/mosaic.h"

#include <memory>
#include <vector>

namespace nacre::calibrate {

/// How a picture was taken.
struct Lighting {
  int channel = 0;
  double exposure_us = 0;
  int width_px = 0;
};

/// What turns a picture of the reference into count rates proportional to radiance, as
/// far as it is known yet.
class RatePictures {
 public:
  RatePictures(const DarkResult& dark,
               const Linearity& linearity,
               const ColourFilters& filters = {})
      : dark_(dark), linearity_(linearity), filters_(filters) {}

  void SetAmbient(const SmoothField& ambient, int width, int height);
  void SetFlatField(const SmoothField& flat, int width, int height);
  void SetGlare(const Glare& glare, int width, int height);

  /// Counts per µs of a picture that this laser lit, hot pixels put right, ambient
  /// light and glare taken off, divided by the flat field. A mosaic's is filled in (see
  /// mosaic.h): `Shares` tells which pixels really saw it.
  std::vector<float> Rates(const acquire::Frame& frame, int channel) const;
  /// Variances of what Rates() gives, for mean rates like these: photons of all light
  /// that falls on a pixel, glare as well, and the dark's noise.
  std::vector<double> Variances(const std::vector<float>& rates,
                                const Lighting& lighting,
                                double gain_electrons_per_count) const;
  /// The planes that see that laser.
  std::vector<PlaneShare> Planes(int channel) const {
    return SharesOf(filters_, channel);
  }
  std::vector<float> Shares(int channel, int width, int height) const {
    return PixelShares(filters_, channel, width, height);
  }

  /// Standard uncertainty of a spot's light for what glare isn't known of, relative.
  double glare_sigma() const { return glare_sigma_; }
  const DarkResult& dark() const { return dark_; }
  const Linearity& linearity() const { return linearity_; }

 private:
  const DarkResult& dark_;
  Linearity linearity_;
  ColourFilters filters_;
  std::vector<float> ambient_;
  std::vector<float> flat_;
  std::unique_ptr<GlareFilter> glare_;
  double glare_sigma_ = 0;
  double kept_ = 1;  // of a point's light, by what glare leaves it
};

}  // namespace nacre::calibrate
