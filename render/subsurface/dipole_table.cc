#include "render/subsurface/dipole_table.h"

#include "core/error.h"
#include "core/parallel.h"

#include <algorithm>
#include <cmath>

namespace nacre::render {
namespace {

/// The smallest disc of the near table, of the largest.
constexpr double kSmallestDisc = 1.0 / 16;

/// From this many radii on, a disc is a point with a second moment.
constexpr double kFarRadii = 4;

/// Nothing of R_d changes below this fraction of a mean free path.
constexpr double kFlatMeanFreePaths = 1.0 / 64;

/// Where the table ends, in mean free paths of the least scattering channel, even for
/// media that absorb nothing and have no other end.
constexpr double kEndMeanFreePaths = 2e4;
constexpr double kEndDecay = 25;

double SmallestMeanFreePath(const ProfileTriple& profiles) {
  return std::min({profiles[0]->MeanFreePathMm(),
                   profiles[1]->MeanFreePathMm(),
                   profiles[2]->MeanFreePathMm()});
}

}  // namespace

double ReachMm(const RadialProfile& profile) {
  const double end = kEndMeanFreePaths * profile.MeanFreePathMm();
  const double decay = profile.EffectiveTransportPerMm();
  return decay * end > kEndDecay ? kEndDecay / decay : end;
}

template <int kBits>
OctaveAxis<kBits>::OctaveAxis(double r_min_mm, double r_max_mm) {
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

template <int kBits>
double OctaveAxis<kBits>::Distance(std::uint32_t index) const {
  const auto r2 = std::bit_cast<float>(origin_ + (index << kShift));
  return std::sqrt(static_cast<double>(r2));
}

template class OctaveAxis<5>;
template class OctaveAxis<1>;
template class OctaveAxis<2>;

DipoleTable::DipoleTable(const ProfileTriple& profiles,
                         double largest_disc_mm,
                         int thread_count) {
  FillFar(profiles);
  FillNear(profiles, largest_disc_mm, thread_count);
}

void DipoleTable::FillFar(const ProfileTriple& profiles) {
  double reach = 0;
  for (const auto& profile : profiles) {
    reach = std::max(reach, ReachMm(*profile));
  }
  reach_mm_ = static_cast<float>(reach);
  far_axis_ =
      SquaredDistanceAxis(kFlatMeanFreePaths * SmallestMeanFreePath(profiles), reach);
  far_.resize(far_axis_.size());
  for (std::uint32_t i = 0; i < far_axis_.size(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      const double r = far_axis_.Distance(i);
      far_[i].rd.v[c] = static_cast<float>(profiles[c]->Rd(r));
      const RadialProfile::Spread spread = profiles[c]->SpreadTerms(r);
      far_[i].slope.v[c] = static_cast<float>(spread.slope);
      far_[i].bend.v[c] = static_cast<float>(spread.bend);
    }
    const auto& rd = far_[i].rd.v;
    total_.push_back(rd[0] + rd[1] + rd[2]);
  }
}

void DipoleTable::FillNear(const ProfileTriple& profiles,
                           double largest_disc_mm,
                           int thread_count) {
  const double flat = kFlatMeanFreePaths * SmallestMeanFreePath(profiles);
  // A margin, so that a disc of exactly the largest radius isn't beyond the last row.
  const double largest = std::max(largest_disc_mm, flat) * 1.001;
  near_axis_ = SquaredDistanceAxis(flat, 1.01 * kFarRadii * largest);
  disc_axis_ = SquaredRadiusAxis(kSmallestDisc * largest, largest);
  near_.resize(std::size_t{disc_axis_.size()} * near_axis_.size());
  ParallelFor(near_axis_.size(), thread_count, [&](std::int64_t index) {
    const auto i = static_cast<std::uint32_t>(index);
    const double r = near_axis_.Distance(i);
    for (std::uint32_t k = 0; k < disc_axis_.size(); ++k) {
      const double disc = disc_axis_.Distance(k);
      for (std::size_t c = 0; c < 3; ++c) {
        near_[std::size_t{k} * near_axis_.size() + i].v[c] =
            static_cast<float>(profiles[c]->DiscMean(r, disc));
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
  const auto disc = disc_axis_.Find(disc2_mm2);
  const ColorLanes* lower =
      &near_[std::size_t{disc.index} * near_axis_.size() + place.index];
  const ColorLanes* upper = lower + near_axis_.size();
  sum += flux * Mix(Mix(lower[0], lower[1], place.fraction),
                    Mix(upper[0], upper[1], place.fraction),
                    disc.fraction);
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
