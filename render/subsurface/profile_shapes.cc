#include "render/subsurface/profile_shapes.h"

#include "render/subsurface/dipole_table.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>

namespace nacre::render {
namespace {

constexpr double kShapeStep = 0.02;  // of a parameter
constexpr double kPerOctave = 16;    // of squared distance
constexpr double kNearestDiscs = 0.1;
constexpr double kFarDiscs = 4;  // from here on a disc is a point

constexpr std::int32_t kZero = std::numeric_limits<std::int32_t>::min();

std::int32_t Rounded(float value) {
  return value > 0 ? static_cast<std::int32_t>(
                         std::lround(std::log(static_cast<double>(value)) / kShapeStep))
                   : kZero;
}

double Value(std::int32_t rounded) {
  return rounded == kZero ? 0 : std::exp(kShapeStep * rounded);
}

/// The rounded parameter below a value, and how far that is on the way to the next.
struct Between {
  std::int32_t below;
  double share;
};

Between Around(float value) {
  if (!(value > 0)) {
    return {kZero, 0};
  }
  const auto exact = static_cast<double>(value);
  const auto below =
      static_cast<std::int32_t>(std::floor(std::log(exact) / kShapeStep));
  const double share = (exact - Value(below)) / (Value(below + 1) - Value(below));
  return {below, std::clamp(share, 0.0, 1.0)};
}

}  // namespace

ProfileShape::ProfileShape(std::shared_ptr<const RadialProfile> profile, double disc_mm)
    : profile_(std::move(profile)),
      total_(profile_->Total()),
      reach_mm_(static_cast<float>(std::max(ReachMm(*profile_), 2 * disc_mm))) {
  const double first = 2 * std::log2(kNearestDiscs * disc_mm);
  const double last = 2 * std::log2(static_cast<double>(reach_mm_));
  low_ = static_cast<float>(first);
  const auto count =
      static_cast<std::size_t>(std::ceil((last - first) * kPerOctave)) + 2;
  for (std::size_t n = 0; n < count; ++n) {
    const double r = std::exp2(0.5 * (first + static_cast<double>(n) / kPerOctave));
    const double value =
        r < kFarDiscs * disc_mm ? profile_->DiscMean(r, disc_mm) : profile_->Rd(r);
    values_.push_back(static_cast<float>(value / total_));
  }
}

float ProfileShape::At(float r2_mm2) const {
  if (r2_mm2 > reach_mm_ * reach_mm_) {
    return 0;
  }
  const float place =
      std::max(0.0F, std::log2(r2_mm2) - low_) * static_cast<float>(kPerOctave);
  const auto n = std::min(static_cast<std::size_t>(place), values_.size() - 2);
  const float along = place - static_cast<float>(n);
  return values_[n] + (values_[n + 1] - values_[n]) * along;
}

double ProfileShapes::TotalAt(const Key& key) const {
  {
    const std::shared_lock lock(guard_);
    if (const auto found = totals_.find(key); found != totals_.end()) {
      return found->second;
    }
  }
  const auto profile = profile_(Value(key.first), Value(key.second));
  const double total = profile == nullptr ? 0 : profile->Total();
  const std::lock_guard lock(guard_);
  return totals_.try_emplace(key, total).first->second;
}

float ProfileShapes::Total(float first, float second) const {
  const Between a = Around(first);
  const Between b = Around(second);
  const auto along = [&](std::int32_t of_first) {
    const double below = TotalAt({of_first, b.below});
    return b.share > 0 ? below + b.share * (TotalAt({of_first, b.below + 1}) - below)
                       : below;
  };
  const double below = along(a.below);
  return static_cast<float>(a.share > 0 ? below + a.share * (along(a.below + 1) - below)
                                        : below);
}

const ProfileShape* ProfileShapes::Find(float first, float second) const {
  const Key key{Rounded(first), Rounded(second)};
  {
    const std::shared_lock lock(guard_);
    if (const auto found = known_.find(key); found != known_.end()) {
      return found->second.get();
    }
  }
  std::unique_ptr<const ProfileShape> made;
  if (auto profile = profile_(Value(key.first), Value(key.second));
      profile != nullptr && profile->Total() > 0) {
    made = std::make_unique<const ProfileShape>(std::move(profile), disc_mm_);
  }
  const std::lock_guard lock(guard_);
  return known_.try_emplace(key, std::move(made)).first->second.get();
}

}  // namespace nacre::render
