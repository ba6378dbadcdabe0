#pragma once

#include "render/subsurface/radial_profile.h"
#include "render/subsurface/subsurface.h"
#include "render/texture.h"

#include <functional>
#include <memory>

namespace nacre::render {

/// The profile of one channel for two parameters, whatever they are to it: absorption
/// and reduced scattering a mm, or albedo and mean free path. Null if light doesn't
/// spread.
using ProfileOf =
    std::function<std::shared_ptr<const RadialProfile>(double first, double second)>;

/// R_d of a medium whose parameters are textures: that of the place where light leaves,
/// R_d(x_i, x_o) = R_d(|x_o − x_i|; parameters at x_o), so that even light brings out
/// the reflectance at each place exactly, sharp as the texture.
///
/// The model itself gives R_d over its total at x_o; the total is a texture apart
/// (`total`), applied where the surface is seen, since exitances are
/// interpolated over more than a texel. Shapes are evaluated for parameters in steps of
/// 2 %, totals are interpolated between.
struct TexturedMedium {
  TexturePtr first;
  TexturePtr second;
  ProfileOf profile;
  float eta = 1.5F;
};

struct TexturedTranslucency {
  std::shared_ptr<const SubsurfaceModel> model;
  TexturePtr total;  ///< a place and channel, what leaves of what enters
};

/// Throws a usage Error if no place scatters in any channel, or for an index below 1.
TexturedTranslucency MakeTextured(const TexturedMedium& medium);

/// The side of the patches for a medium: four fifths of the smallest mean free path of
/// any place and channel, but no less than of a tenth of their mean.
float TexturedPatchMm(const TexturedMedium& medium);

}  // namespace nacre::render
