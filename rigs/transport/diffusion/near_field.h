#pragma once

#include "rigs/transport/diffusion/beam_footprint.h"
#include "rigs/transport/diffusion/channel_setup.h"
#include "rigs/transport/diffusion/radial_profile.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace nacre::rigs::diffusion {

/// reference / discrete for a homogeneous slab, column by column around a beam: what to
/// multiply a discrete exitance by.
class NearField {
 public:
  struct Request {
    double step_mm = 1;
    int half_columns = 0;   ///< the window's, from the beam's column to its edge
    double from_depth = 0;  ///< LocalDomain::FromDepth()
    double tolerance = 1e-6;
  };
  /// `profiles` holds the reference of each substance.
  NearField(const ChannelSetup& setup,
            const Request& request,
            const std::vector<BeamPoint>& beam,
            const std::vector<RadialProfile>& profiles);

  /// log of the factor of that substance, at a column (dx, dy) from the beam's.
  double LogFactor(std::size_t substance, int dx, int dy) const {
    const int side = 2 * half_ + 1;
    return logs_[substance][static_cast<std::size_t>(std::int64_t{dy + half_} * side +
                                                     dx + half_)];
  }

 private:
  int half_;
  std::vector<std::vector<double>> logs_;
};

}  // namespace nacre::rigs::diffusion
