#pragma once

#include "core/point_mm.h"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

/// What a real rig does beside the ideal of calibration.h, and how it is undone. Every
/// struct as it stands by default means "nothing of that kind is known": applying it
/// changes nothing. A count rate becomes one proportional to radiance in this order:
///   counts − dark → Linearity → / exposure → − ambient → RemoveGlare (glare.h)
///   → / flat field;     hot pixels and saturated ones are left out.
namespace nacre::calibrate {

/// Something about a rig that a user should know; `name` is short, stable and
/// hyphenated, `text` a sentence with figures. The names are listed in
/// docs/twin-defects.md.
struct Warning {
  std::string name;
  std::string text;
};

/// The response's curvature: a signal of c counts above dark would have been
/// c (1 + b1 c + b2 c²) of a linear sensor.
struct Linearity {
  double b1_per_count = 0;
  double b2_per_count2 = 0;
  /// Standard uncertainty of the factor 1 + b1 c + b2 c² at the saturation level.
  double sigma_at_saturation = 0;

  double Linear(double counts) const {
    return counts * (1 + counts * (b1_per_count + counts * b2_per_count2));
  }
  /// d Linear / d counts: standard deviations grow by it.
  double Slope(double counts) const {
    return 1 + counts * (2 * b1_per_count + 3 * counts * b2_per_count2);
  }
};

/// A smooth function over a picture: a polynomial Σ c_k u^i v^j of total degree
/// `degree` in u = 2 (x + ½) / width − 1, v likewise, in the order 1, u, v, u², uv, v²,
/// u³, … Without coefficients it is `value_if_empty`.
struct SmoothField {
  int degree = 0;
  std::vector<double> coefficients = {};
  double sigma = 0;  ///< standard uncertainty of a value
  double value_if_empty = 0;

  bool empty() const { return coefficients.empty(); }
  double At(double u, double v) const;
  /// At every pixel's centre, row by row from the top.
  std::vector<float> Map(int width_px, int height_px) const;
};

/// A pixel whose dark current is far from the others'.
struct HotPixel {
  std::int32_t index = 0;         ///< row · width + column
  double rate_counts_per_us = 0;  ///< beyond the mean dark level's
};

/// Light that lens and camera scatter far from where it belongs: the share of a point's
/// light that falls on a pixel at a distance, by distance; the same everywhere in the
/// picture and in all channels.
struct Glare {
  std::vector<double> radius_px;        ///< ascending; log-log interpolation between
  std::vector<double> density_per_px2;  ///< of the point's light in all
  std::vector<double> sigma_per_px2;    ///< its standard uncertainty
  double fraction = 0;  ///< of the light that lands beyond radius_px.front()
  double fraction_sigma = 0;

  bool empty() const { return radius_px.empty(); }
  /// Within radius_px.front(), where the spot itself hides it, what it is there: no
  /// less, since it falls outwards. Beyond the last radius the last two go on.
  double DensityAt(double distance_px) const;
};

/// The laser's spot as the camera sees it on the sample plane, a pixel's own width
/// taken off: second central moments, mm².
struct SpotProfile {
  double xx_mm2 = 0;
  double xy_mm2 = 0;
  double yy_mm2 = 0;
  double sigma_mm2 = 0;  ///< standard uncertainty of each
};

/// Noise of the light itself, relative; 0 where it wasn't found.
struct LightNoise {
  double ripple = 0;            ///< of a spot's power, from picture to picture
  double ripple_sigma = 0;      ///< standard uncertainty of it
  double speckle_contrast = 0;  ///< a pixel's, at a spot, at most
};

/// A mirror stops short of where it was sent, by as much on either side it comes from:
/// the beam is at angle − x_rad · sign(angle − angle before), y likewise.
struct ScanHysteresis {
  double x_rad = 0;
  double y_rad = 0;
  double sigma_rad = 0;
};

/// What is amiss with a pixel's neighbours once it overflows: so far from a saturated
/// pixel nothing is to be believed, pixels.
struct Blooming {
  int reach_px = 0;       ///< along columns
  int side_reach_px = 0;  ///< along rows
};

/// What the pixels of a colour mosaic see, by colour (red, green, blue): relative to
/// the colour that sees most of that light.
struct ColourFilters {
  std::string mosaic;  ///< as in acquire::CameraInfo; "": monochrome, the rest is void
  std::array<double, 3> white{1, 1, 1};       ///< of the lamp
  std::array<double, 3> ambient{1, 1, 1};     ///< of Corrections::ambient
  std::vector<std::array<double, 3>> lasers;  ///< a channel
};

/// What every picture of a calibration says beside calibration.h.
struct Corrections {
  ColourFilters filters;
  Linearity linearity;
  SmoothField flat_field{.value_if_empty = 1};  ///< relative response; mean 1
  SmoothField ambient;  ///< of the sample with the laser off, counts per µs; of a
                        ///< mosaic, of the colour that sees most of it
  std::vector<HotPixel> hot_pixels;      ///< ascending
  double dark_spread_counts_per_us = 0;  ///< of the other pixels' dark current
  double row_noise_counts = 0;           ///< common to a row, anew in every picture
  Glare glare;
  Blooming blooming;
  std::vector<SpotProfile> spots;  ///< a channel
  LightNoise light_noise;
  ScanHysteresis hysteresis;
  std::vector<Warning> warnings;
};

/// A plane a little off the sample plane: z = height + slope_x x + slope_y y.
struct SamplePlane {
  double height_mm = 0;
  double slope_x = 0;
  double slope_y = 0;
  double height_sigma_mm = 0;
  double slope_sigma = 0;
};

}  // namespace nacre::calibrate
