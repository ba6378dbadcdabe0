#pragma once

#include "render/subsurface/textured_model.h"

#include <cstdint>
#include <map>
#include <memory>
#include <shared_mutex>
#include <vector>

namespace nacre::render {

/// A profile over its total, tabulated over squared distance, averaged near its source
/// over a disc of one size.
class ProfileShape {
 public:
  ProfileShape(std::shared_ptr<const RadialProfile> profile, double disc_mm);

  float At(float r2_mm2) const;
  /// Without the disc.
  double Rd(double r_mm) const { return profile_->Rd(r_mm) / total_; }
  float reach_mm() const { return reach_mm_; }

 private:
  std::shared_ptr<const RadialProfile> profile_;
  double total_;
  float reach_mm_;
  float low_;  ///< log2 of the first squared distance
  std::vector<float> values_;
};

/// Shapes by their parameters, rounded to 2 %, made when first asked for. What is found
/// depends on the parameters alone. Safe to ask from many threads.
class ProfileShapes {
 public:
  ProfileShapes(ProfileOf profile, double disc_mm)
      : profile_(std::move(profile)), disc_mm_(disc_mm) {}

  /// What leaves of what enters, interpolated between parameters 2 % apart.
  float Total(float first, float second) const;

  /// Null if nothing is scattered.
  const ProfileShape* Find(float first, float second) const;

 private:
  /// Parameters, rounded.
  using Key = std::pair<std::int32_t, std::int32_t>;

  double TotalAt(const Key& key) const;

  ProfileOf profile_;
  double disc_mm_;
  mutable std::shared_mutex guard_;
  mutable std::map<Key, std::unique_ptr<const ProfileShape>> known_;
  mutable std::map<Key, double> totals_;
};

}  // namespace nacre::render
