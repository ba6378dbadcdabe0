#pragma once

#include "acquire/session.h"
#include "calibrate/calibration.h"
#include "core/options.h"
#include "core/progress.h"

namespace nacre::calibrate {

struct CalibrateOptions {
  double max_reprojection_rms_px = 0.5;
  double max_laser_map_rms_mm = 0.1;
  double reference_reflectance_sigma = 0;

  template <class Self, class Visitor>
  static void Visit(Self& self, Visitor&& visit) {
    visit("max_reprojection_rms_px",
          self.max_reprojection_rms_px,
          Range{0, 100},
          "refuse a camera model that fits worse");
    visit("max_laser_map_rms_mm",
          self.max_laser_map_rms_mm,
          Range{0, 100},
          "refuse a laser map that fits worse");
    visit("reference_reflectance_sigma",
          self.reference_reflectance_sigma,
          Range{0, 1},
          "standard uncertainty of the rig's reference_reflectance, from its "
          "certificate (often 0.005); 0: exact");
  }
};

/// Geometry, laser map and radiometry from the calibration pictures of a session (the
/// grid pictures needn't have been taken). Uses nothing but pictures and the rig
/// description. Throws BadData if a target can't be made out or a fit is worse than the
/// options allow.
Calibration Calibrate(const acquire::SessionReader& session,
                      const CalibrateOptions& options,
                      const ProgressFunction& progress = {});

/// The part of it that the capture needs before it can aim at the grid.
acquire::ScanMap EstimateScanMap(const acquire::SessionReader& session,
                                 const CalibrateOptions& options,
                                 const ProgressFunction& progress = {});

}  // namespace nacre::calibrate
