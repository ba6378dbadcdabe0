#include "render/subsurface/dipole_table.h"

#include "core/error.h"
#include "core/parallel.h"

#include <algorithm>
#include <cmath>

namespace nacre::render {
namespace {

/// Rows of the near table: squared radii 0, 1/6, … 1 of the largest.
constexpr std::uint32_t kDiscs = 7;

/// From this many radii on, a disc is a point with a second moment.
constexpr double kFarRadii = 4;

/// Nothing of R_d changes below this fraction of a mean free path.
constexpr double kFlatMeanFreePaths = 1.0 / 64;

/// Where the table ends, in mean free paths of the least scattering channel, even for
/// media that absorb nothing and have no other end.
constexpr double kEndMeanFreePaths = 2e4;
constexpr double kEndDecay = 25;

double SmallestMeanFreePath(const std::array<DipoleProfile, 3>& profiles) {
  return std::min({profiles[0].MeanFreePathMm(),
                   profiles[1].MeanFreePathMm(),
                   profiles[2].MeanFreePathMm()});
}

double Reach(const DipoleProfile& profile) {
  const double end = kEndMeanFreePaths * profile.MeanFreePathMm();
  const double decay = profile.EffectiveTransportPerMm();
  return decay * end > kEndDecay ? kEndDecay / decay : end;
}

}  // namespace

SquaredDistanceAxis::SquaredDistanceAxis(double r_min_mm, double r_max_mm) {
  Expect(r_min_mm > 0 && r_max_mm > r_min_mm, "an axis of positive length");
  const auto step_below = [](double r) {
    return std::bit_cast<std::uint32_t>(static_cast<float>(r * r)) & ~kMask;
  };
  origin_ = step_below(r_min_mm);
  const std::uint32_t last = step_below(r_max_mm) + kMask + 1;
  size_ = ((last - origin_) >> kShift) + 1;
  low_ = std::bit_cast<float>(origin_);
  // The last place is one step of the float before the last entry: index + 1 exists.
  high_ = std::bit_cast<float>(last - 1);
}

double SquaredDistanceAxis::Distance(std::uint32_t index) const {
  const auto r2 = std::bit_cast<float>(origin_ + (index << kShift));
  return std::sqrt(static_cast<double>(r2));
}

DipoleTable::DipoleTable(const std::array<DipoleProfile, 3>& profiles,
                         double largest_disc_mm,
                         int thread_count) {
  FillFar(profiles);
  FillNear(profiles, largest_disc_mm, thread_count);
}

void DipoleTable::FillFar(const std::array<DipoleProfile, 3>& profiles) {
  double reach = 0;
  for (const DipoleProfile& profile : profiles) {
    reach = std::max(reach, Reach(profile));
  }
  reach_mm_ = static_cast<float>(reach);
  far_axis_ =
      SquaredDistanceAxis(kFlatMeanFreePaths * SmallestMeanFreePath(profiles), reach);
  far_.resize(far_axis_.size());
  for (std::uint32_t i = 0; i < far_axis_.size(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      const double r = far_axis_.Distance(i);
      far_[i].rd.v[c] = static_cast<float>(profiles[c].Rd(r));
      const DipoleProfile::Spread spread = profiles[c].SpreadTerms(r);
      far_[i].slope.v[c] = static_cast<float>(spread.slope);
      far_[i].bend.v[c] = static_cast<float>(spread.bend);
    }
  }
}

void DipoleTable::FillNear(const std::array<DipoleProfile, 3>& profiles,
                           double largest_disc_mm,
                           int thread_count) {
  const double flat = kFlatMeanFreePaths * SmallestMeanFreePath(profiles);
  // A margin, so that a disc of exactly the largest radius isn't beyond the last row.
  const double largest = std::max(largest_disc_mm, flat) * 1.001;
  near_axis_ = SquaredDistanceAxis(flat, 1.01 * kFarRadii * largest);
  discs_per_mm2_ = static_cast<float>((kDiscs - 1) / (largest * largest));
  near_.resize(std::size_t{kDiscs} * near_axis_.size());
  ParallelFor(near_axis_.size(), thread_count, [&](std::int64_t index) {
    const auto i = static_cast<std::uint32_t>(index);
    const double r = near_axis_.Distance(i);
    for (std::uint32_t k = 0; k < kDiscs; ++k) {
      const double disc = largest * std::sqrt(static_cast<double>(k) / (kDiscs - 1));
      for (std::size_t c = 0; c < 3; ++c) {
        near_[std::size_t{k} * near_axis_.size() + i].v[c] =
            static_cast<float>(profiles[c].DiscMean(r, disc));
      }
    }
  });
}

void DipoleTable::AddDisc(const Distance& distance,
                          float disc2_mm2,
                          const ColorLanes& flux,
                          ColorLanes& sum) const {
  constexpr auto kFar2 = static_cast<float>(kFarRadii * kFarRadii);
  if (distance.squared_mm2 > kFar2 * disc2_mm2) {
    AddFar(distance, 0.25F * disc2_mm2, flux, sum);
    return;
  }
  const auto place = near_axis_.Find(distance.squared_mm2);
  const float disc = disc2_mm2 * discs_per_mm2_;
  const std::uint32_t row = std::min(static_cast<std::uint32_t>(disc), kDiscs - 2);
  const float row_fraction = disc - static_cast<float>(row);
  const ColorLanes* lower = &near_[std::size_t{row} * near_axis_.size() + place.index];
  const ColorLanes* upper = lower + near_axis_.size();
  sum += flux * Mix(Mix(lower[0], lower[1], place.fraction),
                    Mix(upper[0], upper[1], place.fraction),
                    row_fraction);
}

void DipoleTable::AddFar(const Distance& distance,
                         float variance_mm2,
                         const ColorLanes& flux,
                         ColorLanes& sum) const {
  const auto place = far_axis_.Find(distance.squared_mm2);
  const FarEntry& a = far_[place.index];
  const FarEntry& b = far_[place.index + 1];
  const ColorLanes spread = Mix(a.slope, b.slope, place.fraction) +
                            Mix(a.bend, b.bend, place.fraction) * distance.in_plane_mm2;
  sum += flux * (Mix(a.rd, b.rd, place.fraction) + spread * variance_mm2);
}

}  // namespace nacre::render
