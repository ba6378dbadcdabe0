#include "rigs/transport/diffusion/channel_setup.h"

#include "core/error.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <numbers>

namespace nacre::rigs::diffusion {
namespace {

constexpr double kUnbounded = std::numeric_limits<double>::infinity();

double BottomFactor(const Slab& slab, double top_factor) {
  switch (slab.bottom) {
    case Bottom::kAir:
      return top_factor;
    case Bottom::kMatched:
    case Bottom::kBlack:
      return 1;
    case Bottom::kWhite:
      return kUnbounded;
  }
  throw LogicError("a bottom of no kind");
}

}  // namespace

std::span<const Medium> PatternMedia(const Phantom& phantom) {
  return std::span(phantom.media)
      .first(static_cast<std::size_t>(phantom.pattern.MediumCount()));
}

ChannelSetup MakeChannelSetup(const Phantom& phantom,
                              std::size_t channel,
                              const DiffusionOptions& options,
                              double half_window_mm) {
  ChannelSetup setup;
  const Slab& slab = phantom.slab;
  setup.top_factor = BoundaryFactor(BoundaryLaw::kExact, slab.eta);
  setup.faces = {setup.top_factor, BottomFactor(slab, setup.top_factor)};
  setup.cut = std::isinf(slab.thickness_mm);
  setup.bottom_diffuses = slab.bottom == Bottom::kWhite && !setup.cut;
  setup.bottom_absorbs = slab.bottom == Bottom::kBlack && !setup.cut;
  setup.shortest_free_path_mm = kUnbounded;
  double slowest = kUnbounded;
  double diffusion_mm = 0;
  for (const Medium& medium : PatternMedia(phantom)) {
    ChannelSetup::Substance s;
    s.medium = {medium.sigma_a_per_mm[channel], medium.ReducedScattering(channel)};
    if (!(s.medium.SigmaTPrime() > 0)) {
      throw BadData(
          fmt::format("the diffusion solver: medium '{}' neither scatters nor absorbs "
                      "in channel {}; use another solver",
                      medium.name,
                      phantom.channels[channel]));
    }
    s.diffusion_mm =
        DiffusionMm(options.classical_coefficient ? DiffusionLaw::kClassical
                                                  : DiffusionLaw::kGrosjean,
                    s.medium);
    s.slab = {.medium = s.medium,
              .diffusion_mm = s.diffusion_mm,
              .thickness_mm = slab.thickness_mm,
              .top_factor = setup.top_factor,
              .bottom_factor = setup.faces.bottom_factor};
    s.decay_per_mm = RobinSlab(s.slab).SlowestDecayPerMm();
    setup.shortest_free_path_mm =
        std::min(setup.shortest_free_path_mm, 1 / s.medium.SigmaTPrime());
    slowest = std::min(slowest, s.decay_per_mm);
    diffusion_mm = std::max(diffusion_mm, s.diffusion_mm);
    setup.substances.push_back(s);
  }
  // Without absorption a half-space has no decay length: R_d falls as a power, and a
  // margin of a few windows is the best there is.
  const double longest_margin_mm =
      4 * (half_window_mm + 10 * setup.shortest_free_path_mm);
  setup.margin_mm = std::min(options.margin_decays / slowest, longest_margin_mm);
  setup.mesh_depth_mm = slab.thickness_mm;
  if (setup.cut) {
    const double half_width_mm = half_window_mm + setup.margin_mm;
    setup.mesh_depth_mm = std::min(8 / slowest, 2 * half_width_mm);
    const double decay = std::hypot(slowest, 0.5 * std::numbers::pi / half_width_mm);
    setup.faces.bottom_factor = 1 / (2 * diffusion_mm * decay);
    for (ChannelSetup::Substance& s : setup.substances) {
      s.decay_per_mm = std::hypot(s.decay_per_mm, 1 / half_width_mm);
    }
  }
  const double thickest_mm = setup.mesh_depth_mm / 8;
  setup.depth = {
      .depth_mm = setup.mesh_depth_mm,
      .first_mm = std::min(options.first_layer_free_paths * setup.shortest_free_path_mm,
                           thickest_mm),
      .growth = options.layer_growth,
      .thickest_mm = thickest_mm};
  return setup;
}

}  // namespace nacre::rigs::diffusion
