#pragma once

#include "render/subsurface/models.h"
#include "render/subsurface/radial_profile.h"

#include <memory>

namespace nacre::render {

/// A homogeneous medium by any profile a channel. Throws a usage Error for an index
/// below 1, or if nothing is scattered in any channel.
std::shared_ptr<const SubsurfaceModel> MakeRadial(const ProfileTriple& profiles,
                                                  float eta,
                                                  const DipoleOptions& options = {});

}  // namespace nacre::render
