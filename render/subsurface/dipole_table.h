#pragma once

#include "render/subsurface/color_lanes.h"
#include "render/subsurface/radial_profile.h"

#include <array>
#include <bit>
#include <cstdint>
#include <vector>

namespace nacre::render {

/// Places on an axis of squared lengths, evenly to the octave, taken from the bits of
/// the float itself, so that finding one takes no logarithm. `kBits`: 2^kBits places to
/// the octave.
template <int kBits>
class OctaveAxis {
 public:
  OctaveAxis() = default;
  OctaveAxis(double r_min_mm, double r_max_mm);

  struct Place {
    std::uint32_t index;
    float fraction;
  };
  /// Distances below r_min count as r_min; beyond r_max the place is the last one.
  Place Find(float r2_mm2) const {
    const float clamped = r2_mm2 < low_ ? low_ : r2_mm2 > high_ ? high_ : r2_mm2;
    const std::uint32_t offset = std::bit_cast<std::uint32_t>(clamped) - origin_;
    return {offset >> kShift, static_cast<float>(offset & kMask) * kStep};
  }
  std::uint32_t size() const { return size_; }
  double Distance(std::uint32_t index) const;

 private:
  static constexpr int kShift = 23 - kBits;
  static constexpr std::uint32_t kMask = (1u << kShift) - 1;
  static constexpr float kStep = 1.0F / static_cast<float>(1u << kShift);
  std::uint32_t origin_ = 0;
  std::uint32_t size_ = 0;
  float low_ = 0;
  float high_ = 0;
};

using SquaredDistanceAxis = OctaveAxis<5>;
using SquaredRadiusAxis = OctaveAxis<1>;

/// Beyond this distance nothing of a profile is left that counts.
double ReachMm(const RadialProfile& profile);

/// R_d of three channels, tabulated over squared distance for sources of finite extent.
/// Good to about 0.05 %.
class DipoleTable {
 public:
  /// For discs up to `largest_disc_mm` in radius; those below 1/16 of it count as that.
  DipoleTable(const ProfileTriple& profiles, double largest_disc_mm, int thread_count);

  /// From a source to x_o.
  struct Distance {
    float squared_mm2;   ///< in space
    float in_plane_mm2;  ///< of it, in the tangent plane of the source; squared
  };

  /// Adds flux · (R_d averaged over a disc of squared radius `disc2_mm2`) to sum.
  void AddDisc(const Distance& distance,
               float disc2_mm2,
               const ColorLanes& flux,
               ColorLanes& sum) const;

  /// Adds flux · R_d for a source, well away, of variance `variance_mm2` along each
  /// direction of its tangent plane.
  void AddFar(const Distance& distance,
              float variance_mm2,
              const ColorLanes& flux,
              ColorLanes& sum) const;

  /// Bounds of R_d, summed over channels, at a squared distance: the tabulated values
  /// on both sides.
  float AtLeast(float r2_mm2) const { return total_[far_axis_.Find(r2_mm2).index + 1]; }
  float AtMost(float r2_mm2) const { return total_[far_axis_.Find(r2_mm2).index]; }

  /// Beyond this, nothing.
  float reach_mm() const { return reach_mm_; }

 private:
  struct FarEntry {
    ColorLanes rd;
    ColorLanes slope;  ///< as DipoleProfile::Spread
    ColorLanes bend;
  };
  void FillFar(const ProfileTriple& profiles);
  void FillNear(const ProfileTriple& profiles,
                double largest_disc_mm,
                int thread_count);

  float reach_mm_ = 0;
  SquaredDistanceAxis far_axis_;
  std::vector<FarEntry> far_;
  std::vector<float> total_;  ///< R_d of all channels, as far_
  SquaredDistanceAxis near_axis_;
  SquaredRadiusAxis disc_axis_;
  std::vector<ColorLanes> near_;  ///< a row for each squared radius
};

}  // namespace nacre::render
