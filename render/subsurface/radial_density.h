#pragma once

#include <functional>
#include <vector>

namespace nacre::render {

/// A density of distances r in a plane, tabulated: p(r) per mm², ∫ p 2πr dr = 1, for
/// importance sampling of places around another. Zero beyond its reach.
class RadialDensity {
 public:
  RadialDensity() = default;
  /// In proportion to `weight(r)`, per mm², between knots spread evenly in log r from
  /// `finest_mm` to `reach_mm`, and a little of it evenly over the disc, so that it is
  /// nowhere far too small.
  RadialDensity(const std::function<double(double)>& weight,
                double finest_mm,
                double reach_mm);

  float Sample(float u) const;  ///< r in mm for u in [0, 1)
  float Pdf(float r_mm) const;  ///< per mm²
  float reach_mm() const { return reach_mm_; }

 private:
  std::size_t RingOf(float r_mm) const;

  float reach_mm_ = 0;
  float log_finest_ = 0;
  float per_log_ = 0;
  std::vector<float> edges_;       ///< of rings, from 0 to the reach
  std::vector<float> cumulative_;  ///< up to and with a ring
  std::vector<float> density_;     ///< per mm², constant over a ring
};

}  // namespace nacre::render
