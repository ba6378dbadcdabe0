#pragma once

#include "acquire/scan_map.h"
#include "calibrate/corrections.h"

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace nacre::calibrate {

/// A position in a picture: pixels, +x right, +y down, the centre of the upper left
/// pixel is (0, 0).
struct PixelPoint {
  double x = 0;
  double y = 0;
};

/// A pinhole camera with Brown's lens distortion [Brown66], and where it stands.
/// Camera frame: x right, y down, z along the view. `camera_from_sample` takes sample
/// coordinates (mm, the plane is z = 0) to camera coordinates: R p + t.
struct CameraGeometry {
  int width_px = 0;
  int height_px = 0;
  double fx_px = 0;
  double fy_px = 0;
  double cx_px = 0;
  double cy_px = 0;
  double k1 = 0;  ///< radial
  double k2 = 0;
  double p1 = 0;  ///< tangential
  double p2 = 0;
  double k3 = 0;
  std::array<double, 9> camera_from_sample_rotation{
      1, 0, 0, 0, 1, 0, 0, 0, 1};  ///< by row
  std::array<double, 3> camera_from_sample_translation_mm{};

  /// The same camera over a plane that isn't quite the sample plane: its x and y are
  /// measured along the sample plane's, from the point above its origin.
  CameraGeometry OnPlane(const SamplePlane& plane) const;

  PixelPoint PixelFromSample(PointMm point) const;
  PointMm SampleFromPixel(PixelPoint pixel) const;
  /// The cosine between the sample's normal and the direction to the camera.
  double CosOut(PointMm point) const;
  /// Area of the sample plane that one pixel sees around there, mm².
  double FootprintMm2(PixelPoint pixel) const;
};

/// Counts of the dark picture at an exposure: offset + rate · exposure.
struct DarkLevel {
  double offset_counts = 0;
  double rate_counts_per_us = 0;
  double offset_sigma_counts = 0;
  double rate_sigma_counts_per_us = 0;
  double Counts(double exposure_us) const {
    return offset_counts + rate_counts_per_us * exposure_us;
  }
};

/// What one laser channel gives on the sensor.
struct ChannelResponse {
  std::string name;
  /// kΦ: Φ is the flux one spot brings to the sample plane, k the count rate of a pixel
  /// that sees unit radiance. Their product is all that is needed, and all that a
  /// reference target can tell:
  ///   Σ_pixels rate · footprint = k Φ ρ / π   over a spot on the reference.
  double flux_scale_counts_mm2_sr_per_us = 0;
  /// Standard deviation over the lattice's spots, relative.
  double flux_scale_spread = 0;
  /// Standard uncertainty of the flux scale, relative.
  double flux_scale_sigma = 0;
};

/// What figures of a calibration are drawn from; no stage computes with it. Arrows are
/// {x, y, dx, dy}: where, and by how much it is off.
struct Diagnostics {
  std::vector<std::array<double, 4>> corners_px;  ///< of the checkerboard
  std::vector<std::array<double, 4>> spots_mm;    ///< of the laser lattice
  /// {counts above dark, deviation from a straight line, the same once corrected}
  std::vector<std::array<double, 3>> response;
};

/// Everything needed to turn counts into R_d; made from pictures alone.
struct Calibration {
  CameraGeometry camera;
  DarkLevel dark;
  double gain_electrons_per_count = 0;
  double read_noise_electrons = 0;
  double saturation_counts = 0;  ///< a pixel at or above it is not to be used
  std::vector<ChannelResponse> channels;
  acquire::ScanMap scan_map;
  double reprojection_rms_px = 0;
  double laser_map_rms_mm = 0;
  double laser_map_max_mm = 0;
  /// Of spots that had no part in the fit.
  double laser_map_held_out_rms_mm = 0;
  double gain_sigma_electrons_per_count = 0;
  double read_noise_sigma_electrons = 0;
  double focal_sigma_px = 0;
  double centre_sigma_px = 0;
  double height_sigma_mm = 0;  ///< of the sample plane's distance from the camera
  Corrections corrections;
  Diagnostics diagnostics;
  std::string session_rig_hash;  ///< of the rig description it was made for
  /// When its session was captured, if that is known (acquire::SessionManifest).
  std::optional<std::int64_t> captured_unix_s = std::nullopt;
  std::string provenance;  ///< JSON text, see core/provenance.h

  /// The cosine of the beam's angle of incidence; the scanner's axis is taken to be
  /// normal to the sample, as the rig's assembly demands.
  double CosIn(PointMm point) const;

  /// R_d in mm⁻² from a count rate, (counts − dark) / exposure:
  ///   R_d = π c(η) / (F_t(η, θ_i) F_t(η, θ_o)) · rate / flux_scale,
  /// light having entered at x_i and being seen at x_o.
  double RdPerRate(int channel, PointMm x_i, PointMm x_o, double eta) const;

  /// Variance of one pixel's counts whose signal above dark is `signal_counts`
  /// (≥ 0, linear): shot noise, read noise, that of rows and rounding [EMVA1288, eq.
  /// 9].
  double VarianceCounts2(double signal_counts) const;
};

/// calibration.json, with provenance. Written atomically.
void WriteCalibration(const std::filesystem::path& path,
                      const Calibration& calibration);

/// Throws BadData naming file and field for anything missing, not finite or senseless.
Calibration ReadCalibration(const std::filesystem::path& path);

}  // namespace nacre::calibrate
