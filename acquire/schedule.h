#pragma once

#include "acquire/rig.h"
#include "acquire/sample_stage.h"

#include <cstdint>
#include <span>
#include <vector>

namespace nacre::acquire {

/// A grid point: column i from the left, row j from the top.
struct GridIndex {
  int i = 0;
  int j = 0;
  friend bool operator==(const GridIndex&, const GridIndex&) = default;
};

/// One picture to be taken. What is lit follows from the target: nothing for kNothing,
/// kAmbient, kCheckerboard and kFlat (those two bring their own light); the laser
/// lattice for kReference; its middle spot for kGlare; the spots of `group` and the
/// patch, if there is one, for kSample.
struct ScheduledPicture {
  Target target = Target::kNothing;
  int pose = 0;            ///< of the checkerboard
  int channel = -1;        ///< of the laser; -1: laser off
  int group = -1;          ///< of spots, for kSample
  int repeat = 0;          ///< counts pictures that differ in nothing else
  double exposure_us = 0;  ///< as requested
};

/// All pictures of a session in the order in which they are taken; a picture's index
/// is its number. A pure function of the rig description:
///   dark frames at every exposure; checkerboard poses; flat pairs; the reference
///   target's laser lattice in each channel, its middle spot in each channel and
///   exposure for glare, and it without the laser; the sample without the laser; then,
///   from `grid_begin` on, each group of grid points × channel × exposure (longest
///   first), in that nesting.
class Schedule {
 public:
  explicit Schedule(const RigDescription& rig);

  std::int64_t size() const { return static_cast<std::int64_t>(pictures_.size()); }
  const ScheduledPicture& operator[](std::int64_t number) const {
    return pictures_[static_cast<std::size_t>(number)];
  }
  /// Number of the first picture of the sample.
  std::int64_t grid_begin() const { return grid_begin_; }
  int group_count() const { return static_cast<int>(group_begin_.size()) - 1; }

  /// Grid points lit together, at least spot_spacing_cells apart along x or y.
  std::span<const GridIndex> Group(int group) const;

  /// The beams that picture calls for, in the order in which they are visited. `map`
  /// aims at the sample; nothing else needs it.
  std::vector<ScanAngle> Beams(std::int64_t number, const ScanMap* map) const;

  /// The n × n scan angles for the reference target, row by row from the top (+y).
  const std::vector<ScanAngle>& lattice() const { return lattice_; }

  /// Every exposure asked for anywhere, ascending.
  const std::vector<double>& exposures_us() const { return exposures_us_; }

 private:
  void AddTargets(const RigDescription& rig);
  void AddLaserTargets(const RigDescription& rig);
  void AddGroups(const RigDescription& rig);

  GridDescription grid_;
  TargetsDescription targets_;
  std::vector<ScheduledPicture> pictures_;
  std::vector<GridIndex> points_;  // group after group
  std::vector<std::size_t> group_begin_{0};
  std::vector<ScanAngle> lattice_;
  std::vector<double> exposures_us_;
  std::int64_t grid_begin_ = 0;
};

}  // namespace nacre::acquire
