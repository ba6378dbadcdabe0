#pragma once

#include "rigs/phantom.h"
#include "rigs/transport/analytic/robin_slab.h"
#include "rigs/transport/diffusion/diffusion_options.h"
#include "rigs/transport/diffusion/mesh.h"
#include "rigs/transport/diffusion/slab_operator.h"

#include <cstddef>
#include <span>
#include <vector>

namespace nacre::rigs::diffusion {

/// One channel of a phantom in diffusion's terms.
struct ChannelSetup {
  struct Substance {
    DiffusionMedium medium;
    double diffusion_mm = 0;
    double decay_per_mm = 0;  ///< slowest lateral decay of a slab of it
    RobinSlabSetup slab;
  };
  std::vector<Substance> substances;
  FaceConditions faces;  ///< of the mesh: the bottom may be a cut through the slab
  double top_factor = 1;
  double mesh_depth_mm = 0;  ///< thickness, or where an infinite slab is cut
  bool cut = false;
  bool bottom_diffuses = false;  ///< white: unscattered light comes back as a source
  bool bottom_absorbs = false;   ///< black: what leaves there counts as absorbed
  double margin_mm = 0;
  double shortest_free_path_mm = 0;
  DepthLayout depth;
};

/// The media that the pattern is made of.
std::span<const Medium> PatternMedia(const Phantom& phantom);

/// `half_window_mm` is how far from the beam results are wanted. Throws BadData for a
/// medium that neither scatters nor absorbs.
ChannelSetup MakeChannelSetup(const Phantom& phantom,
                              std::size_t channel,
                              const DiffusionOptions& options,
                              double half_window_mm);

}  // namespace nacre::rigs::diffusion
