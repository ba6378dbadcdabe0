#pragma once

#include "factor/internal/method.h"
#include "factor/internal/profiles.h"

#include <vector>

namespace nacre::factor::internal {

/// As many can be told apart.
inline constexpr int kMostGaussians = 12;

/// How one channel's profiles are fitted.
struct ProfileBasis {
  std::vector<double> beta_per_mm2;  ///< widest last
  std::vector<Gaussian> gaussians;
  std::vector<double> weight;  ///< [cell] of the squared error
};

/// Widths of `terms` Gaussians in a geometric series, its ends chosen for the least
/// weighted error of the channel's mean slice.
ProfileBasis ChooseGaussians(const reconstruct::RdHeader& header,
                             const ChannelScan& scan,
                             int terms,
                             double tail_weight);

/// w_t of every point of grid and margin, [channel][term][y][x]: the least weighted
/// error of √(P(x_i) P(x_o)), by rounds in each of which the profiles at the other end
/// of each pair are held relative to a point's own, which leaves a nonnegative
/// least-squares problem a point. The first round takes both ends to be the same: the
/// profile that fits the slice's own rings. Each round reads all slices, a rank those
/// of its rows of points and, for the margin, a window's radius around them.
std::vector<float> FitProfiles(Job& job,
                               const std::vector<ProfileBasis>& bases,
                               int rounds);

}  // namespace nacre::factor::internal
