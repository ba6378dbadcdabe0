#pragma once

#include "acquire/capture.h"
#include "acquire/session.h"

#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace nacre::testing {

/// All that calibration has to find out, chosen by the test. The pictures are drawn
/// with OpenCV's own camera model, not ours.
struct SyntheticTruth {
  int width_px = 400;
  int height_px = 320;
  double focal_px = 1100;
  double centre_x_px = 203.5;
  double centre_y_px = 155.0;
  std::vector<double> distortion{-0.11, 0.05, 3e-4, -5e-4};  ///< k1 k2 p1 p2
  double distance_mm = 400;
  double tilt_rad = 0.2;   ///< of the camera, about the sample's x axis
  double roll_rad = 0.05;  ///< about its own axis
  double offset_counts = 60;
  double dark_counts_per_us = 2e-5;
  double gain_electrons_per_count = 4;
  double read_noise_electrons = 8;
  double saturation_counts = 4095;  ///< where the pixels' wells are full
  double flat_counts_per_us = 0.2;
  double board_counts_per_us = 0.2;
  std::vector<double> flux_scale_counts_mm2_sr_per_us{900, 500};
  double spot_sigma_mm = 0.4;
  std::size_t dropped_spots = 0;  ///< a speck of dirt on the reference target
  bool no_board = false;          ///< somebody forgot to put it there

  /// A scanner with pincushion, offset, rotation and unequal scales.
  PointMm LaserAt(acquire::ScanAngle angle) const;
};

/// A rig.toml that suits the default truth, with some texts replaced by others.
std::string SyntheticRigToml(
    const std::vector<std::pair<std::string, std::string>>& edits = {});

/// Takes the calibration pictures of that rig into `folder`. The noise is a pure
/// function of the picture's number.
void CaptureSynthetic(const SyntheticTruth& truth,
                      const std::string& rig_toml,
                      const std::filesystem::path& folder);

/// Where OpenCV says that a point of the sample plane is seen.
cv::Point2d TruePixel(const SyntheticTruth& truth, PointMm point);

/// The camera's centre in sample coordinates, mm.
cv::Vec3d TrueCameraCentre(const SyntheticTruth& truth);

}  // namespace nacre::testing
