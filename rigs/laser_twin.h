#pragma once

#include "acquire/illuminator.h"
#include "rigs/sample_pose.h"
#include "rigs/world.h"

#include <memory>
#include <string>
#include <vector>

namespace nacre::rigs {

/// Two mirrors over the sample. The first deflects along x, the second, `separation_mm`
/// further on, along y and down onto the plane, `distance_mm` below it:
///   x = e tan α_x + D tan α_x / cos α_y,  y = D tan α_y,
/// which draws a square of angles as a pincushion [Marshall04]; then the whole scanner
/// is turned and shifted a little, as no rig is mounted perfectly.
struct LaserModel {
  double distance_mm = 400;
  double separation_mm = 6;
  double rotation_rad = 0;
  PointMm offset_mm;
  double max_angle_rad = 0.3;
  double spot_sigma_mm = 0.12;  ///< of the Gaussian spot; geometric mean of its axes
  double spot_aspect = 1;       ///< of the longer axis to the shorter
  double spot_angle_rad = 0;    ///< of the longer axis, from +x
  /// Each mirror stops so far short of where it was sent, whichever side it comes from.
  /// Spots are visited in their order over and over, so the last precedes the first.
  double hysteresis_rad = 0;
  /// The mirrors are driven by a DAC of 12 bits: beams go to its nearest steps.
  bool has_dac = false;
  std::vector<double> power_mw;  ///< a channel; flux of one spot
  std::vector<std::string> channels;
  SamplePose sample;

  Spot SpotAt(acquire::ScanAngle angle) const;
  /// Where the beam passes `height_mm` above the sample plane.
  PointMm PointAt(acquire::ScanAngle angle, double height_mm) const;
  /// Of the round spots that a beam is made of.
  double RoundSigmaMm() const;
};

class LaserTwin final : public acquire::Illuminator {
 public:
  LaserTwin(LaserModel model, std::shared_ptr<World> world);
  ~LaserTwin() override;

  acquire::IlluminatorInfo Info() const override;
  void Light(std::span<const acquire::ScanAngle> spots, int channel) override;
  void Blank() noexcept override;

 private:
  LaserModel model_;
  std::shared_ptr<World> world_;
};

}  // namespace nacre::rigs
