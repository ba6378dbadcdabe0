#include "render/scene_reader/objects.h"

#include <cmath>
#include <memory>
#include <numbers>

namespace nacre::render {
namespace {

Vec3 Direction(Element& element) {
  if (element.Has("direction")) {
    if (element.Has("toWorld")) {
      element.Fail("give either 'direction' or 'toWorld'");
    }
    const Vec3 direction = element.Point("direction", {0, 0, 1});
    if (!(Length(direction) > 0)) {
      element.FailAt("direction", "a direction of length 0");
    }
    return Normalized(direction);
  }
  return Normalized(element.ToWorld().Vector({0, 0, 1}));
}

PointLight ReadPoint(Element& element) {
  if (element.Has("position") && element.Has("toWorld")) {
    element.Fail("give either 'position' or 'toWorld'");
  }
  const Vec3 moved = element.ToWorld().Point({0, 0, 0});
  return {element.Point("position", moved), element.Spectrum("intensity", kWhite)};
}

SpotLight ReadSpot(Element& element) {
  const Transform to_world = element.ToWorld();
  const double cutoff_deg =
      InRange(element, "cutoffAngle", element.Float("cutoffAngle", 20), {0.001, 180});
  const double beam_deg = InRange(element,
                                  "beamWidth",
                                  element.Float("beamWidth", 0.75 * cutoff_deg),
                                  {0, cutoff_deg});
  constexpr double kDegree = std::numbers::pi / 180;
  return {to_world.Point({0, 0, 0}),
          Normalized(to_world.Vector({0, 0, 1})),
          element.Spectrum("intensity", kWhite),
          static_cast<float>(cutoff_deg * kDegree),
          static_cast<float>(beam_deg * kDegree)};
}

EnvironmentLight ReadEnvironment(Element& element) {
  const Transform to_world = element.ToWorld();
  const Vec3 x = Normalized(to_world.Vector({1, 0, 0}));
  const Vec3 y = Normalized(to_world.Vector({0, 1, 0}));
  const Vec3 z = Normalized(to_world.Vector({0, 0, 1}));
  const float shear = std::abs(Dot(x, y)) + std::abs(Dot(y, z)) + std::abs(Dot(z, x));
  if (!(shear < 1e-4F)) {
    element.FailAt("toWorld", "an environment can only be turned and mirrored");
  }
  const auto scale = static_cast<float>(
      InRange(element, "scale", element.Float("scale", 1), {0, 1e9}));
  return {std::make_shared<Environment>(ReadPicture(element), Frame(x, y, z), scale)};
}

ProjectorLight ReadProjector(Element& element) {
  constexpr double kDegree = std::numbers::pi / 180;
  const double fov_deg =
      InRange(element, "fov", element.Float("fov", 45), {0.001, 179});
  ProjectorLight projector;
  projector.world_from_projector = element.ToWorld();
  if (projector.world_from_projector.Determinant() == 0) {
    element.FailAt("toWorld", "the transform flattens the projector");
  }
  projector.irradiance = element.TextureOr("irradiance", kWhite);
  projector.scale = static_cast<float>(
      InRange(element, "scale", element.Float("scale", 1), {0, 1e9}));
  projector.half_width = static_cast<float>(std::tan(0.5 * fov_deg * kDegree));
  projector.half_height = projector.half_width / projector.irradiance->Aspect();
  return projector;
}

}  // namespace

void ReadEmitter(Element element) {
  const std::string type = element.type();
  Light light;
  light.sampling_weight = static_cast<float>(
      InRange(element, "samplingWeight", element.Float("samplingWeight", 1), {0, 1e9}));
  if (type == "point") {
    light.source = ReadPoint(element);
  } else if (type == "spot") {
    light.source = ReadSpot(element);
  } else if (type == "directional") {
    const Vec3 direction = Direction(element);
    light.source = DirectionalLight{direction, element.Spectrum("irradiance", kWhite)};
  } else if (type == "constant") {
    light.source = ConstantLight{element.Spectrum("radiance", kWhite)};
  } else if (type == "envmap") {
    light.source = ReadEnvironment(element);
  } else if (type == "projector") {
    light.source = ReadProjector(element);
  } else if (type == "area") {
    element.Fail("an area light belongs inside the shape that shines");
  } else {
    UnknownPlugin(
        element,
        {"point", "spot", "directional", "constant", "envmap", "projector", "area"});
    return;
  }
  element.Finish();
  element.document().scene.lights.push_back(light);
}

}  // namespace nacre::render
