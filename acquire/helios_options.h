#pragma once

#include <array>
#include <string>
#include <vector>

namespace nacre::acquire {

/// How a laser projector behind a Helios DAC is to be found and driven.
struct HeliosOptions {
  std::string name;  ///< of the DAC, as `nacre doctor` lists it; empty: the only one
  int points_per_s = 20'000;
  double settle_us = 300;  ///< of the mirrors, after the longest way between two spots
  double max_angle_rad = 0;   ///< optical, of both mirrors at full deflection
  std::vector<double> power;  ///< a channel; share of what the laser can
  double reconnect_s = 60;    ///< how long a DAC that went away is waited for
};

/// What no picture may exceed. See LaserLimits.
struct SafetyDescription {
  std::array<double, 2> field_x_rad{};  ///< lit spots lie within
  std::array<double, 2> field_y_rad{};
  double max_power = 0;     ///< share of what the laser can, any channel
  double max_dwell_us = 0;  ///< in one place without a pause
  double max_duty = 0;      ///< share of the time in one place
  double max_lit_s = 0;     ///< without a dark pause
};

}  // namespace nacre::acquire
