#pragma once

#include "render/transform.h"
#include "render/vec.h"

#include <cstdint>
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

struct Light {
  std::variant<PointLight, SpotLight, DirectionalLight, ConstantLight> source;
  float sampling_weight = 1;
};

}  // namespace nacre::render
