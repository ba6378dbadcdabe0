#pragma once

#include "acquire/laser_frame.h"
#include "acquire/scan_field.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace nacre::acquire {

/// How one beam lights several spots: it visits them in turn, dark on the way and until
/// the mirrors have settled. A cycle has a slot for each spot that any picture may
/// have, used or not, so that the mean power of a spot is the same in all pictures; and
/// every exposure is a whole number of cycles, so that it doesn't matter when it
/// begins.
struct SpotTiming {
  int points_per_s = 0;
  int slots = 0;          ///< a cycle
  int settle_points = 0;  ///< dark, at the beginning of a slot
  int dwell_points = 0;   ///< lit, the rest of it
  int cycle_points = 0;
  int cycles_per_frame = 0;

  int FramePoints() const { return cycle_points * cycles_per_frame; }
  double DwellUs() const { return 1e6 * dwell_points / points_per_s; }
  /// Of the time that a spot is lit, and of the beam's power that it gets.
  double Share() const { return static_cast<double>(dwell_points) / cycle_points; }
};

/// The longest dwell that the exposures leave room for. Throws DeviceError if they
/// leave none, or aren't whole numbers of points, saying what to change.
SpotTiming PlanSpots(std::span<const double> exposures_us,
                     int most_spots,
                     double settle_us,
                     int points_per_s);

/// A frame of whole cycles over the spots in their order, first and last point dark.
/// Spots that fall on the same step are one. Requires that there is a slot for each.
LaserFrame MakeSpotFrame(const SpotTiming& timing,
                         const ScanField& field,
                         std::span<const ScanAngle> spots,
                         std::array<std::uint8_t, 3> level);

/// A frame of no light, as short as may be.
LaserFrame MakeDarkFrame(int points_per_s);

/// Helios firmware loses frames of some sizes: those whose transfer, 7 bytes a point
/// and 5 more, ends in a certain place of a USB packet.
bool IsGoodPointCount(int points);

}  // namespace nacre::acquire
