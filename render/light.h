#pragma once

#include "render/environment.h"
#include "render/texture.h"
#include "render/transform.h"
#include "render/vec.h"

#include <memory>
#include <variant>

namespace nacre::render {

/// Lights in vacuum; the ones on surfaces are part of their shapes.

struct PointLight {
  Vec3 position;
  Color intensity;  ///< W sr⁻¹
};

/// Full intensity up to the beam's half-angle, falling linearly in angle to none at the
/// cut-off.
struct SpotLight {
  Vec3 position;
  Vec3 direction;  ///< unit
  Color intensity;
  float cutoff_rad = 0.349F;
  float beam_rad = 0.262F;
};

/// From infinitely far.
struct DirectionalLight {
  Vec3 direction;    ///< unit, the way the light goes
  Color irradiance;  ///< on a plane across it, W per scene unit squared
};

/// The same radiance from everywhere.
struct ConstantLight {
  Color radiance;
};

/// A picture of the light from everywhere.
struct EnvironmentLight {
  std::shared_ptr<const Environment> environment;
};

/// A slide projector: a pinhole that throws a picture. In its own frame it looks along
/// +z with +y up and +x to the left, as a camera does: from its place, the picture is
/// seen upright.
struct ProjectorLight {
  Transform world_from_projector;
  TexturePtr irradiance;  ///< on a plane across its axis at distance 1
  float scale = 1;
  float half_width = 0.5F;  ///< of the picture, at distance 1
  float half_height = 0.5F;
};

struct Light {
  std::variant<PointLight,
               SpotLight,
               DirectionalLight,
               ConstantLight,
               EnvironmentLight,
               ProjectorLight>
      source;
  float sampling_weight = 1;
};

}  // namespace nacre::render
