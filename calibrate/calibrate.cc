#include "calibrate/calibrate.h"

#include "calibrate/geometry.h"
#include "calibrate/laser_map.h"
#include "calibrate/radiometry.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/options_json.h"
#include "core/provenance.h"

#include <fmt/format.h>

namespace nacre::calibrate {
namespace {

// What both the laser map and the whole calibration begin with.
struct Foundation {
  GeometryResult geometry;
  DarkLevel dark;
  LaserMapResult laser;
};

Foundation EstimateFoundation(const acquire::SessionReader& session,
                              const CalibrateOptions& options,
                              const ProgressFunction& progress) {
  Validate(options);
  Foundation f;
  f.geometry = EstimateGeometry(session, progress);
  if (!(f.geometry.reprojection_rms_px <= options.max_reprojection_rms_px)) {
    throw BadData(fmt::format(
        "{}: the camera model misses the checkerboard's corners by {:.3f} px rms, more "
        "than max_reprojection_rms_px = {}; is checkerboard_square_mm right, and were "
        "the boards flat and sharp?",
        session.folder().string(),
        f.geometry.reprojection_rms_px,
        options.max_reprojection_rms_px));
  }
  f.dark = EstimateDark(session);
  f.laser = EstimateLaserMap(session, f.geometry.camera, f.dark);
  if (!(f.laser.rms_mm <= options.max_laser_map_rms_mm)) {
    throw BadData(fmt::format(
        "{}: the laser map misses its spots by {:.4f} mm rms, more than "
        "max_laser_map_rms_mm = {}; did the reference target lie in the sample plane?",
        session.folder().string(),
        f.laser.rms_mm,
        options.max_laser_map_rms_mm));
  }
  return f;
}

// Of the pictures used; the rest of the session doesn't matter, nor does when it was.
std::string HashOfPictures(const acquire::SessionReader& session) {
  std::string hashes;
  for (std::int64_t number = 0; number < session.schedule().grid_begin(); ++number) {
    hashes += session.Entry(number).hash;
  }
  return HashHex(hashes.data(), hashes.size());
}

}  // namespace

acquire::ScanMap EstimateScanMap(const acquire::SessionReader& session,
                                 const CalibrateOptions& options,
                                 const ProgressFunction& progress) {
  return EstimateFoundation(session, options, progress).laser.map;
}

Calibration Calibrate(const acquire::SessionReader& session,
                      const CalibrateOptions& options,
                      const ProgressFunction& progress) {
  const Foundation f = EstimateFoundation(session, options, progress);
  const PhotonTransfer transfer = EstimatePhotonTransfer(session, f.dark);
  Calibration calibration;
  calibration.camera = f.geometry.camera;
  calibration.dark = f.dark;
  calibration.gain_electrons_per_count = transfer.gain_electrons_per_count;
  calibration.read_noise_electrons = transfer.read_noise_electrons;
  calibration.saturation_counts = transfer.saturation_counts;
  calibration.channels = EstimateFluxScales(
      session, f.geometry.camera, f.laser.map, f.dark, transfer.saturation_counts);
  calibration.scan_map = f.laser.map;
  calibration.reprojection_rms_px = f.geometry.reprojection_rms_px;
  calibration.laser_map_rms_mm = f.laser.rms_mm;
  calibration.laser_map_max_mm = f.laser.max_mm;
  calibration.session_rig_hash = session.manifest().rig_hash;
  calibration.provenance =
      Provenance{.command = "calibrate",
                 .options = OptionsToJson(options),
                 .inputs = Json::array({{{"rig_xxh3", session.manifest().rig_hash},
                                         {"pictures", session.schedule().grid_begin()},
                                         {"xxh3", HashOfPictures(session)}}})}
          .ToString();
  return calibration;
}

}  // namespace nacre::calibrate
