#pragma once

#include "factor/material.h"

#include <vector>

namespace nacre::factor::internal {

/// The material with one of its channels left in all but values.
Material ChannelHeader(Material header, int channel);

/// The maps that a channel needs, of the set of maps that it uses.
std::vector<float> ChannelMaps(const Material& header, int channel, const float* maps);

}  // namespace nacre::factor::internal
