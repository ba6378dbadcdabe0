#include "calibrate/calibrate.h"

#include "calibrate/filter_estimate.h"
#include "calibrate/geometry.h"
#include "calibrate/glare_estimate.h"
#include "calibrate/laser_map.h"
#include "calibrate/radiometry.h"
#include "calibrate/rate_picture.h"
#include "calibrate/response.h"
#include "calibrate/warnings.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/options_json.h"
#include "core/provenance.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <utility>

namespace nacre::calibrate {
namespace {

// What both the laser map and the whole calibration begin with.
struct Foundation {
  GeometryResult geometry;
  DarkResult dark;
  ColourFilters filters;
  double saturation_counts = 0;
  ResponseResult response;
  SmoothField reference_ambient;
  LaserMapResult laser;

  RatePictures Pictures() const {
    RatePictures pictures(dark, response.linearity, filters);
    pictures.SetAmbient(
        reference_ambient, geometry.camera.width_px, geometry.camera.height_px);
    return pictures;
  }
};

// A pixel with three counts is a mosaic's that was interpolated before we saw it: its
// noise isn't the sensor's any more.
void RefuseThreeCounts(const acquire::SessionReader& session) {
  if (session.manifest().camera.SamplesPerPixel() != 1) {
    throw BadData(
        session.folder().string() +
        ": pictures of three counts a pixel can't be calibrated; capture in a Bayer "
        "or monochrome pixel format (camera.pixel_format)");
  }
}

Foundation EstimateFoundation(const acquire::SessionReader& session,
                              const CalibrateOptions& options,
                              const ProgressFunction& progress) {
  Validate(options);
  Foundation f;
  RefuseThreeCounts(session);
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
  f.dark = EstimateDarkMaps(session);
  f.filters = EstimateFilters(session, f.dark);
  // Where the sensor saturates must be known before its curve, its gain after.
  f.saturation_counts = EstimatePhotonTransfer(session, f.dark).saturation_counts;
  f.response = EstimateResponse(session, f.dark, f.saturation_counts);
  f.reference_ambient =
      EstimateAmbient(session, f.dark, f.response.linearity, f.filters, 0);
  f.laser = EstimateLaserMap(session, f.geometry.camera, f.Pictures());
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

void StoreGeometry(const Foundation& f, Calibration& calibration) {
  calibration.camera = f.geometry.camera;
  calibration.reprojection_rms_px = f.geometry.reprojection_rms_px;
  calibration.focal_sigma_px = f.geometry.focal_sigma_px;
  calibration.centre_sigma_px = f.geometry.centre_sigma_px;
  calibration.height_sigma_mm = f.geometry.height_sigma_mm;
  calibration.scan_map = f.laser.map;
  calibration.laser_map_rms_mm = f.laser.rms_mm;
  calibration.laser_map_max_mm = f.laser.max_mm;
  calibration.laser_map_held_out_rms_mm = f.laser.held_out_rms_mm;
  calibration.corrections.hysteresis = f.laser.hysteresis;
}

void StoreSensor(const Foundation& f,
                 const PhotonTransfer& transfer,
                 Calibration& calibration) {
  calibration.dark = f.dark.level;
  calibration.gain_electrons_per_count = transfer.gain_electrons_per_count;
  calibration.gain_sigma_electrons_per_count = transfer.gain_sigma_electrons_per_count;
  calibration.read_noise_electrons = transfer.read_noise_electrons;
  calibration.read_noise_sigma_electrons = transfer.read_noise_sigma_electrons;
  calibration.saturation_counts = transfer.saturation_counts;
  calibration.corrections.filters = f.filters;
  calibration.corrections.linearity = f.response.linearity;
  calibration.corrections.hot_pixels = f.dark.hot_pixels;
  calibration.corrections.dark_spread_counts_per_us = f.dark.spread_counts_per_us;
  calibration.corrections.row_noise_counts = f.dark.row_noise_counts;
}

// At most that many points of a kind: a figure shows no more.
constexpr std::size_t kMostPoints = 400;

Diagnostics DiagnosticsOf(const Foundation& f) {
  Diagnostics diagnostics;
  const auto every = [](std::size_t count) {
    return std::max<std::size_t>(1, (count + kMostPoints - 1) / kMostPoints);
  };
  const std::vector<CornerResidual>& corners = f.geometry.residuals;
  for (std::size_t k = 0; k < corners.size(); k += every(corners.size())) {
    const CornerResidual& r = corners[k];
    diagnostics.corners_px.push_back({r.at.x, r.at.y, r.off.x, r.off.y});
  }
  for (const SpotResidual& r : f.laser.residuals) {
    diagnostics.spots_mm.push_back({r.at.x, r.at.y, r.off.x, r.off.y});
  }
  const std::vector<ResponsePoint>& points = f.response.points;
  for (std::size_t k = 0; k < points.size(); k += every(points.size())) {
    diagnostics.response.push_back(
        {points[k].counts, points[k].deviation, points[k].residual});
  }
  return diagnostics;
}

// Farther from a spot than its own light reaches, pixels.
double BeyondSpotPx(const acquire::SessionReader& session,
                    const RatePictures& pictures,
                    const Foundation& f) {
  // Spots are a pixel or two wide, whatever the sensor; somewhat more of a fine one.
  constexpr double kLeastPx = 3;
  const CameraGeometry& camera = f.geometry.camera;
  const double pixel_mm =
      std::sqrt(camera.FootprintMm2({0.5 * camera.width_px, 0.5 * camera.height_px}));
  constexpr double kSigmas = 3.7;
  return std::max(
      kLeastPx + camera.width_px / 500.0,
      kSigmas * SpotSigmaMm(session, camera, f.laser.map, pictures) / pixel_mm);
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
  const PhotonTransfer transfer =
      EstimatePhotonTransfer(session, f.dark, f.response.linearity);
  Calibration calibration;
  StoreGeometry(f, calibration);
  StoreSensor(f, transfer, calibration);
  Corrections& corrections = calibration.corrections;
  const int width = f.geometry.camera.width_px;
  const int height = f.geometry.camera.height_px;
  const FlatResult flat = EstimateFlatField(session,
                                            f.dark,
                                            f.response.linearity,
                                            transfer.saturation_counts,
                                            transfer.gain_electrons_per_count);
  corrections.flat_field = flat.field;
  corrections.ambient =
      EstimateAmbient(session, f.dark, f.response.linearity, f.filters, 1);
  RatePictures pictures = f.Pictures();
  const std::vector<acquire::ScanAngle>& lattice = session.schedule().lattice();
  const GlareResult glare =
      EstimateGlare(session,
                    pictures,
                    f.geometry.camera.PixelFromSample(
                        f.laser.map.SampleFromAngle(lattice[lattice.size() / 2])),
                    transfer.saturation_counts,
                    BeyondSpotPx(session, pictures, f));
  corrections.glare = glare.glare;
  corrections.blooming = glare.blooming;
  pictures.SetGlare(glare.glare, width, height);
  pictures.SetFlatField(flat.field, width, height);
  FluxResult flux =
      EstimateFluxScales(session, f.geometry.camera, f.laser.map, pictures, transfer);
  calibration.channels = std::move(flux.channels);
  for (ChannelResponse& channel : calibration.channels) {
    channel.flux_scale_sigma =
        std::hypot(channel.flux_scale_sigma,
                   options.reference_reflectance_sigma /
                       session.rig().targets.reference_reflectance);
  }
  corrections.spots = std::move(flux.spots);
  corrections.light_noise = flux.light_noise;
  calibration.diagnostics = DiagnosticsOf(f);
  corrections.warnings =
      WarningsOf(calibration,
                 {.flat_residual = flat.residual,
                  .flat_noise = flat.noise,
                  .reference_ambient = f.reference_ambient,
                  .missed_spots = f.laser.missed,
                  .pitch_mm = session.rig().grid.pitch_mm,
                  .longest_exposure_us = session.rig().camera.exposures_us.front()});
  calibration.session_rig_hash = session.manifest().rig_hash;
  calibration.captured_unix_s = session.manifest().captured_unix_s;
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
