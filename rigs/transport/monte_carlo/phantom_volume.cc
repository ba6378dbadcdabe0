#include "rigs/pattern_mixture.h"
#include "rigs/transport/monte_carlo/volume.h"

#include <cmath>

namespace nacre::rigs::monte_carlo {
namespace {

Optics OpticsOf(const Medium& medium, std::size_t channel) {
  return {medium.sigma_a_per_mm[channel],
          medium.sigma_s_per_mm[channel],
          medium.g[channel]};
}

// Both phase functions at work: the mean cosine of scattering is that of the light that
// either one scatters. Henyey and Greenstein's function of that mean stands for their
// sum, which it equals in σ_s' and, if the two g agree, altogether.
Optics Mix(const Optics& first, const Optics& second, double second_fraction) {
  Optics mixed;
  mixed.sigma_a_per_mm =
      std::lerp(first.sigma_a_per_mm, second.sigma_a_per_mm, second_fraction);
  mixed.sigma_s_per_mm =
      std::lerp(first.sigma_s_per_mm, second.sigma_s_per_mm, second_fraction);
  const double forward = std::lerp(first.sigma_s_per_mm * first.g,
                                   second.sigma_s_per_mm * second.g,
                                   second_fraction);
  mixed.g = mixed.sigma_s_per_mm > 0 ? forward / mixed.sigma_s_per_mm : 0;
  return mixed;
}

// One medium for each entry of a palette.
std::vector<Optics> Mixtures(const std::vector<Blend>& palette,
                             const std::vector<Optics>& media) {
  std::vector<Optics> mixtures;
  mixtures.reserve(palette.size());
  for (const Blend& blend : palette) {
    mixtures.push_back(
        Mix(media[blend.first], media[blend.second], blend.second_fraction));
  }
  return mixtures;
}

VoxelGrid Grid(const Voxels& voxels) {
  return {.count = voxels.layout.count,
          .size_mm = voxels.layout.size_mm,
          .left_mm = voxels.layout.left_mm,
          .lower_mm = voxels.layout.lower_mm,
          .medium = voxels.label};
}

// A mixture as voxels as high as the slab: one that ends is the same all the way down.
VoxelGrid Grid(const MixtureMap& map) {
  const MixtureMap::Layout& layout = map.layout();
  VoxelGrid grid{.count = {layout.count_x, layout.count_y, 1},
                 .size_mm = {layout.cell_mm, layout.cell_mm, 1},
                 .left_mm = layout.left_mm,
                 .lower_mm = layout.lower_mm,
                 .medium = {}};
  const auto cells = static_cast<std::size_t>(layout.count_x) *
                     static_cast<std::size_t>(layout.count_y);
  for (std::size_t k = 0; k < cells; ++k) {
    grid.medium.push_back(ChainLabel(static_cast<double>(map.Fractions()[k])));
  }
  return grid;
}

}  // namespace

Volume MakeVolume(const Phantom& phantom, std::size_t channel) {
  Volume volume;
  for (const Medium& medium : phantom.media) {
    volume.media.push_back(OpticsOf(medium, channel));
  }
  volume.bottom = phantom.slab.bottom;
  volume.layers = {{phantom.slab.thickness_mm, phantom.slab.eta, 0}};
  if (!phantom.layers.empty()) {
    volume.layers.clear();
    for (const SlabLayer& layer : phantom.layers) {
      volume.layers.push_back({layer.thickness_mm, layer.eta, layer.medium});
    }
  } else if (phantom.voxels != nullptr) {
    volume.media = Mixtures(phantom.voxels->palette, volume.media);
    volume.voxels = Grid(*phantom.voxels);
  } else if (phantom.pattern.type == PatternType::kMixture) {
    volume.media = Mixtures(ChainPalette(volume.media.size()), volume.media);
    volume.voxels = Grid(*phantom.pattern.mixture);
  } else {
    volume.pattern = phantom.pattern;
  }
  return volume;
}

}  // namespace nacre::rigs::monte_carlo
