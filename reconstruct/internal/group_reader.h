#pragma once

#include "acquire/session.h"
#include "calibrate/calibration.h"
#include "calibrate/session_state.h"
#include "reconstruct/internal/hdr_merge.h"
#include "reconstruct/internal/plane_reader.h"
#include "reconstruct/internal/spot_rings.h"
#include "reconstruct/rd_dataset.h"

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace nacre::reconstruct::internal {

/// What the pictures of one group of spots show, on the lattice of cells that all
/// windows are cut from: R_d as if all light had entered with factor 1 (see
/// GroupReader::EnterFactor), summed over the group's spots.
struct GroupPicture {
  std::vector<float> rd;         ///< [channel][cell]
  std::vector<float> sigma;      ///< of noise; below 0 where it isn't measured
  std::vector<float> floor;      ///< standard deviation of what glare leaves there
  std::vector<SpotRings> rings;  ///< [channel][spot], rows padded to the longest group
  std::int64_t frame_count = 0;
  std::int64_t saturated_count = 0;
};

/// Pictures of groups to R_d on the lattice. Reading is const and may be done from
/// several threads.
class GroupReader {
 public:
  /// All arguments must outlive this. `state`: of the session; its plane is that of
  /// `calibration.camera` already.
  GroupReader(const acquire::SessionReader& session,
              const calibrate::Calibration& calibration,
              const calibrate::SessionState& state,
              const RdHeader& header,
              const calibrate::SpotProfile& spot,
              int thread_count);

  const CellLattice& lattice() const { return planes_.front().weights().lattice(); }
  /// Of the first plane, which is all of a monochrome sensor.
  const CellWeights& weights() const { return planes_.front().weights(); }
  const calibrate::CameraGeometry& camera() const { return planes_.front().camera(); }
  double RingMm() const { return rings_.RingMm(); }
  /// Spots of the longest group.
  std::size_t MostSpots() const;

  /// Whether all of the group's pictures were taken, or left out on purpose.
  bool IsThere(int group) const;
  /// A hash of the pictures that Read() would read.
  std::uint64_t StateOf(int group) const;

  GroupPicture Read(int group) const;
  const acquire::SessionReader& session() const { return session_; }
  /// Adds the numbers of the pictures that Read() reads, in that order.
  void AddPictures(int group, std::vector<std::int64_t>& numbers) const;

  /// R_d of light that entered at grid point (i, j) of that group is this factor times
  /// the lattice's. The laser's power when the pictures were taken is in it.
  double EnterFactor(int group, int channel, int i, int j) const;
  /// The laser's power in the group's pictures, in units of the calibration's.
  double RelativeFlux(int group, int channel) const;

  /// A grid point at a time, row by row: whether the laser went there. The rig's
  /// outline and an adaptive capture leave points out.
  std::vector<bool> LitPoints() const;

  std::size_t SharedBytes() const;
  /// Memory that one call of Read() needs, and what its result holds.
  std::size_t WorkingBytes() const;
  std::size_t ResultBytes() const;

 private:
  // A plane's part in a channel's mean, its rates being divided by what its colour sees
  // of the laser.
  struct Part {
    std::size_t plane;
    float factor;
  };
  const std::vector<std::int64_t>& Pictures(int group, int channel) const;
  void AddPlanes(const SurfaceModel& surface, int thread_count);
  void ReadPlanes(const RateFrame& rates,
                  int group,
                  std::size_t channel,
                  CellValues cells) const;
  void ToRd(CellValues cells) const;
  void ReadRings(const RateFrame& rates,
                 int group,
                 int channel,
                 std::span<SpotRings> rings) const;

  const acquire::SessionReader& session_;
  const calibrate::Calibration& calibration_;
  const calibrate::SessionState& state_;
  const RdHeader& header_;
  std::vector<PlaneReader> planes_;       // those that any channel needs
  std::vector<std::vector<Part>> parts_;  // a channel
  RingReader rings_;
  std::vector<PointMm> spots_;  // on the surface, a grid point
  /// [group · channels + channel]: numbers of the pictures, one an exposure.
  std::vector<std::vector<std::int64_t>> pictures_;
  /// R_d of unit rate is exit_factor_[cell] · that of the spot and channel.
  std::vector<float> exit_factor_;
  float glare_sigma_ = 0;  // of what is taken away as glare, relative
};

}  // namespace nacre::reconstruct::internal
