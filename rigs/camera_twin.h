#pragma once

#include "acquire/camera.h"
#include "rigs/checkerboard.h"
#include "rigs/laser_view.h"
#include "rigs/sensor.h"
#include "rigs/world.h"

#include <cstdint>
#include <memory>
#include <vector>

namespace nacre::rigs {

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
  double spot_sigma_mm = 0.1;
};

/// A camera that takes pictures of the simulated world. Its noise is a pure function of
/// (seed, picture_number, pixel): the same picture asked for again is the same picture,
/// in another process too.
class CameraTwin final : public acquire::Camera {
 public:
  /// `sample`: the phantom under a Gaussian beam of the laser's spot size.
  CameraTwin(CameraModel model,
             std::shared_ptr<const Transport> sample,
             std::shared_ptr<const World> world,
             int thread_count = 0);

  acquire::CameraInfo Info() const override;
  double SetExposureUs(double exposure_us) override;
  std::optional<acquire::Frame> Capture(std::uint64_t picture_number,
                                        std::chrono::milliseconds timeout) override;

  /// Mean electrons a pixel per µs of what is there now, before noise.
  const std::vector<float>& Rates();

 private:
  void ComputeRates(std::vector<float>& rates) const;

  CameraModel model_;
  std::shared_ptr<const World> world_;
  int thread_count_;
  LaserView laser_view_;
  PlaneMap rays_;
  double exposure_us_ = 1000;
  std::vector<float> rates_;  // of world_->revision == rates_revision_
  std::uint64_t rates_revision_ = 0;
  bool has_rates_ = false;
};

}  // namespace nacre::rigs
