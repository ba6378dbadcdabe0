#pragma once

#include "reconstruct/rd_dataset.h"

#include <array>
#include <cstdint>
#include <vector>

namespace nacre {
class Ranks;
}

namespace nacre::reconstruct::internal {

/// What is known of R_d beyond the windows: in each of eight directions, the outer part
/// of a slice is fitted by R_d = exp(a − κ r) / r², the form of a diffuse tail
/// [Jensen01, eq. 4]. Farther out tails may fall faster, in a slab for instance, of
/// which a window says nothing: that is what the falloff corrects, a factor a channel
/// and distance.
class TailMap {
 public:
  /// Distances at which the falloff is given, in half widths of a window. Linear in
  /// between, constant outside; 1 at the first, where the window ends.
  static constexpr std::array<double, 5> kNodes = {1.0, 1.4, 2.0, 3.0, 4.5};
  using Falloff = std::array<float, kNodes.size()>;

  explicit TailMap(const RdHeader& header);

  /// Fits the tails of slice (i, j) from its values within `outer` (0 … 1) of the
  /// window's half width. May be called for different slices at the same time.
  void Fit(int i, int j, const RdSlice& slice, double outer);

  /// Collective: of ranks' fits each has those of its share of the slices, and then
  /// all.
  void Join(const Ranks* ranks);

  /// R_d(x_i, x_o) of grid point (i, j) at the cell (du, dv) cells right of and below
  /// it: by reciprocity the light's way back is as good a witness, and knows the
  /// material at x_o, so this is the geometric mean of both. 0 beyond the reach.
  float Extrapolate(int i, int j, int channel, int du, int dv) const;

  void SetFalloff(int channel, const Falloff& falloff) {
    falloff_[static_cast<std::size_t>(channel)] = falloff;
  }
  const Falloff& falloff(int channel) const {
    return falloff_[static_cast<std::size_t>(channel)];
  }

  /// Shares of the two nodes around the distance of (du, dv): node n has 1 − second,
  /// node n + 1 has second.
  struct Place {
    int node = 0;
    float second = 0;
  };
  Place PlaceOf(int du, int dv) const;

  /// Cells beyond which tails are taken to be nothing: three windows.
  int Reach() const { return reach_; }

 private:
  struct Tail {
    float log_r2_rd = 0;  ///< a
    float slope_per_mm = 0;
    bool known = false;
  };
  struct Way {
    float r_mm;
    float log_r2;
    int sector;
    Place place;
  };
  static constexpr int kSectors = 8;

  const Tail& At(int i, int j, int channel, int sector) const {
    return tails_[static_cast<std::size_t>(
        ((std::int64_t{j} * header_.points_x + i) * channels_ + channel) * kSectors +
        sector)];
  }
  Tail FitSector(const RdSlice& slice, int channel, int sector, double outer_mm) const;
  const Way& WayTo(int du, int dv) const {
    return ways_[static_cast<std::size_t>(std::int64_t{dv + reach_} * (2 * reach_ + 1) +
                                          du + reach_)];
  }

  RdHeader header_;
  int channels_;
  int reach_;
  std::vector<Way> ways_;
  std::vector<Tail> tails_;
  std::vector<Falloff> falloff_;
};

}  // namespace nacre::reconstruct::internal
