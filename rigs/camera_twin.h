#pragma once

#include "acquire/camera.h"
#include "rigs/checkerboard.h"
#include "rigs/colour_filters.h"
#include "rigs/laser_view.h"
#include "rigs/light_noise.h"
#include "rigs/optics.h"
#include "rigs/sample_pose.h"
#include "rigs/sensor.h"
#include "rigs/world.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

namespace nacre::rigs {

/// Light that neither laser nor lamp makes; off by default.
struct AmbientModel {
  double electrons_per_us = 0;  ///< that a pixel collects from white in the middle
  double gradient = 0;          ///< relative change from the middle to the right edge
  double sample_albedo = 0.5;   ///< of the sample under diffuse white light
};

/// What lies in the sample plane beside the targets.
struct PatchModel {
  PointMm centre_mm;
  double radius_mm = 3;
  double reflectance = 0;
};

/// What the camera twin needs to know of itself and of what may lie under it.
struct CameraModel {
  PinholeCamera geometry;
  SensorModel sensor;
  std::uint64_t seed = 1;
  /// Electrons that a pixel collects per µs from a radiance of 1 mW mm⁻² sr⁻¹, one a
  /// laser channel.
  std::vector<double> electrons_per_us_per_radiance;
  /// Electrons a pixel collects per µs from white card under the lamp, which burns for
  /// the checkerboard and the flat card only.
  double lamp_electrons_per_us = 1;
  double card_reflectance = 0.9;
  CheckerboardModel board;
  double reference_reflectance = 1;
  std::vector<double> spot_flux_mw;  ///< that arrives on the sample plane, a channel
  double spot_sigma_mm = 0.1;        ///< of the world's round spots
  SamplePose sample_pose;
  /// Of the sample's gloss: the lit spot is seen like a diffuse target's of so much.
  double specular_reflectance = 0;
  OpticsModel optics;
  FilterModel filters;
  AmbientModel ambient;
  LightNoiseModel light_noise;
  std::optional<PatchModel> patch;
  double picture_period_s = 0.05;
};

/// A camera that takes pictures of the simulated world. Its noise is a pure function of
/// (seed, picture_number, pixel): the same picture asked for again is the same picture,
/// in another process too.
class CameraTwin final : public acquire::Camera {
 public:
  /// `sample`: the phantom under a Gaussian beam of the laser's spot size.
  CameraTwin(CameraModel model,
             const std::shared_ptr<const Transport>& sample,
             std::shared_ptr<const World> world,
             int thread_count = 0);

  acquire::CameraInfo Info() const override;
  double SetExposureUs(double exposure_us) override;
  std::optional<acquire::Frame> Capture(std::uint64_t picture_number,
                                        std::chrono::milliseconds timeout) override;

  /// Mean electrons a pixel per µs of what is there now, before noise, in the picture
  /// of that number: beams ripple from one to the next. Drift and ambient light left
  /// out.
  const std::vector<float>& Rates(std::uint64_t picture_number = 0);

  const Optics& optics() const { return optics_; }
  const Sensor& sensor() const { return sensor_; }

 private:
  void ComputeRates(std::uint64_t picture_number, std::vector<float>& rates) const;
  void ComputeSampleRates(const std::vector<Spot>& spots,
                          std::vector<float>& rates) const;
  std::vector<float> ComputeAmbient() const;
  bool SeesAmbient() const;

  CameraModel model_;
  std::shared_ptr<const World> world_;
  int thread_count_;
  LaserView sample_view_;
  std::optional<LaserView> plane_view_;  // where the sample isn't in the plane
  PlaneMap rays_;
  Optics optics_;
  Sensor sensor_;
  double exposure_us_ = 1000;
  std::vector<float> rates_;  // of world_->revision == rates_revision_
  std::uint64_t rates_revision_ = 0;
  std::uint64_t rates_picture_ = 0;
  bool has_rates_ = false;
  std::vector<float> ambient_;  // on white
  std::vector<float> exposed_;  // what is added up for a picture
};

}  // namespace nacre::rigs
