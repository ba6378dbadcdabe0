#include "render/world.h"

#include "render/warp.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace nacre::render {
namespace {

constexpr float kUnbounded = std::numeric_limits<float>::infinity();
constexpr float kUniformSpherePdf = 0.25F * kInvPi;

LightSample FromPoint(Vec3 light, Color intensity, Vec3 position) {
  const Vec3 to_light = light - position;
  const float distance2 = Dot(to_light, to_light);
  if (!(distance2 > 0)) {
    return {};
  }
  const float distance = std::sqrt(distance2);
  return {to_light / distance, distance, intensity / distance2, 1, true};
}

float SpotFalloff(const SpotLight& spot, Vec3 to_light) {
  const float cosine = std::clamp(-Dot(spot.direction, to_light), -1.0F, 1.0F);
  const float angle = std::acos(cosine);
  if (angle >= spot.cutoff_rad) {
    return 0;
  }
  return angle <= spot.beam_rad
             ? 1.0F
             : (spot.cutoff_rad - angle) / (spot.cutoff_rad - spot.beam_rad);
}

// Total power of a light, roughly: only how often it is chosen depends on it.
Color PowerOf(const Light& light, float scene_radius) {
  const float disk = kPi * scene_radius * scene_radius;
  if (const auto* point = std::get_if<PointLight>(&light.source)) {
    return point->intensity * (4 * kPi);
  }
  if (const auto* spot = std::get_if<SpotLight>(&light.source)) {
    return spot->intensity *
           (2 * kPi *
            (1 - 0.5F * (std::cos(spot->cutoff_rad) + std::cos(spot->beam_rad))));
  }
  if (const auto* directional = std::get_if<DirectionalLight>(&light.source)) {
    return directional->irradiance * disk;
  }
  if (const auto* projector = std::get_if<ProjectorLight>(&light.source)) {
    return projector->irradiance->Mean() *
           (projector->scale * 4 * projector->half_width * projector->half_height);
  }
  if (const auto* far = std::get_if<EnvironmentLight>(&light.source)) {
    return far->environment->Mean() * (kPi * disk);
  }
  return std::get<ConstantLight>(light.source).radiance * (kPi * disk);
}

// A plane at distance 1 sees E = I cos³ θ.
LightSample FromProjector(const ProjectorLight& projector, Vec3 position) {
  const Vec3 pinhole = projector.world_from_projector.Point({0, 0, 0});
  LightSample sample = FromPoint(pinhole, {1, 1, 1}, position);
  const Transform& t = projector.world_from_projector;
  const Frame frame(Normalized(t.Vector({1, 0, 0})),
                    Normalized(t.Vector({0, 1, 0})),
                    Normalized(t.Vector({0, 0, 1})));
  const Vec3 local = frame.ToLocal(-sample.wi);
  const float x = local.x / (local.z * projector.half_width);
  const float y = local.y / (local.z * projector.half_height);
  if (!(sample.pdf > 0) || !(local.z > 0) || std::abs(x) > 1 || std::abs(y) > 1) {
    return {};
  }
  const Color irradiance =
      projector.irradiance->At({0.5F * (1 - x), 0.5F * (1 + y)}) * projector.scale;
  sample.radiance = sample.radiance * irradiance / (local.z * local.z * local.z);
  return sample;
}

// Seen from outside, a sphere is a cone; [Shirley96].
LightSample SampleSphere(const Sphere& sphere, Color radiance, Vec3 position, Vec2 u) {
  const Vec3 to_center = sphere.center - position;
  const float distance2 = Dot(to_center, to_center);
  const float sin2 = sphere.radius * sphere.radius / distance2;
  const float one_minus_cos = sin2 / (1 + std::sqrt(1 - sin2));
  const float pdf = 1 / (2 * kPi * one_minus_cos);
  const Frame frame(to_center / std::sqrt(distance2));
  const Vec3 wi = frame.ToWorld(SquareToCone(u, one_minus_cos));
  const float along = Dot(to_center, wi);
  const float inside =
      std::max(0.0F, sphere.radius * sphere.radius - (distance2 - along * along));
  return {
      wi, along - std::sqrt(inside), radiance / pdf, pdf, false, SurfaceOffset(sphere)};
}

bool SeenAsCone(const Sphere& sphere, Vec3 position) {
  const Vec3 d = sphere.center - position;
  return !sphere.inward && Dot(d, d) > 1.0001F * sphere.radius * sphere.radius;
}

}  // namespace

Ray ShadowRay(const SurfaceHit& hit, const LightSample& light) {
  const Vec3 origin = OffsetOrigin(hit, light.wi);
  if (std::isinf(light.distance)) {
    return {origin, light.wi};
  }
  // Aimed anew at the point of the light: along light.wi itself, a ray whose origin was
  // moved would meet a curved light early where it only grazes it.
  const Vec3 to_light = hit.position + light.wi * light.distance - origin;
  const float distance = Length(to_light);
  return {origin,
          to_light / distance,
          0,
          std::max(0.0F, distance * 0.9999F - light.margin)};
}

World::World(const Scene& scene, int thread_count)
    : scene_(scene),
      geometry_(scene.shapes, scene.instances, thread_count),
      source_of_shape_(scene.shapes.size(), -1) {
  const float radius = std::max(geometry_.radius(), 1e-6F);
  for (const Light& light : scene.lights) {
    if (std::holds_alternative<ConstantLight>(light.source) ||
        std::holds_alternative<EnvironmentLight>(light.source)) {
      backgrounds_.push_back(sources_.size());
    }
    Source source;
    source.light = &light;
    AddSource(std::move(source), PowerOf(light, radius), light.sampling_weight);
  }
  for (std::size_t i = 0; i < scene.shapes.size(); ++i) {
    const Shape& shape = scene.shapes[i];
    if (!shape.radiance) {
      continue;
    }
    source_of_shape_[i] = static_cast<int>(sources_.size());
    Source source;
    source.emitter.emplace(shape);
    source.shape_index = static_cast<std::uint32_t>(i);
    const float area = static_cast<float>(source.emitter->area());
    AddSource(std::move(source), *shape.radiance * (kPi * area), shape.sampling_weight);
  }
  // A power beyond all floats is the largest: infinities have no shares.
  const float most = std::numeric_limits<float>::max() /
                     static_cast<float>(std::max<std::size_t>(1, sources_.size()));
  float total = 0;
  for (Source& source : sources_) {
    source.probability = std::min(source.probability, most);
    total += source.probability;
  }
  float cumulative = 0;
  for (Source& source : sources_) {
    source.probability = total > 0 ? source.probability / total
                                   : 1.0F / static_cast<float>(sources_.size());
    cumulative += source.probability;
    source.cumulative = cumulative;
  }
}

void World::AddSource(Source source, Color power, float weight) {
  source.probability = std::max(0.0F, Luminance(power)) * weight;
  sources_.push_back(std::move(source));
}

bool World::IsDeltaLight(std::size_t light) const {
  const Source& source = sources_[light];
  return source.light != nullptr &&
         !std::holds_alternative<ConstantLight>(source.light->source) &&
         !std::holds_alternative<EnvironmentLight>(source.light->source);
}

LightSample World::SampleLight(Vec3 position, Vec3 side, float u_light, Vec2 u) const {
  for (std::size_t i = 0; i < sources_.size(); ++i) {
    if (u_light < sources_[i].cumulative || i + 1 == sources_.size()) {
      const float probability = sources_[i].probability;
      if (!(probability > 0)) {
        return {};
      }
      LightSample sample = SampleLight(i, position, side, u);
      sample.radiance *= 1 / probability;
      sample.pdf *= probability;
      return sample;
    }
  }
  return {};
}

LightSample World::SampleLight(std::size_t light,
                               Vec3 position,
                               Vec3 side,
                               Vec2 u) const {
  const Source& source = sources_[light];
  if (source.light == nullptr) {
    return SampleEmitter(source, position, u);
  }
  const auto& any = source.light->source;
  if (const auto* point = std::get_if<PointLight>(&any)) {
    return FromPoint(point->position, point->intensity, position);
  }
  if (const auto* spot = std::get_if<SpotLight>(&any)) {
    LightSample sample = FromPoint(spot->position, spot->intensity, position);
    const float falloff = sample.pdf > 0 ? SpotFalloff(*spot, sample.wi) : 0;
    sample.radiance *= falloff;
    sample.pdf = falloff > 0 ? sample.pdf : 0;
    return sample;
  }
  if (const auto* directional = std::get_if<DirectionalLight>(&any)) {
    return {-directional->direction, kUnbounded, directional->irradiance, 1, true};
  }
  if (const auto* projector = std::get_if<ProjectorLight>(&any)) {
    return FromProjector(*projector, position);
  }
  if (const auto* far = std::get_if<EnvironmentLight>(&any)) {
    const Environment::Sample sample = far->environment->SampleDirection(u);
    return {sample.direction,
            kUnbounded,
            far->environment->Radiance(sample.direction) / sample.pdf,
            sample.pdf,
            false};
  }
  const Color radiance = std::get<ConstantLight>(any).radiance;
  if (side == Vec3{}) {
    return {
        SquareToSphere(u), kUnbounded, radiance / kUniformSpherePdf, kUniformSpherePdf};
  }
  // A constant light is best sampled by the cosine at the surface.
  const Vec3 local = SquareToCosineHemisphere(u);
  const float pdf = CosineHemispherePdf(local.z);
  return {Frame(side).ToWorld(local), kUnbounded, radiance / pdf, pdf, false};
}

LightSample World::SampleEmitter(const Source& source, Vec3 position, Vec2 u) const {
  const Shape& shape = scene_.shapes[source.shape_index];
  if (const auto* sphere = std::get_if<Sphere>(&shape.geometry);
      sphere != nullptr && SeenAsCone(*sphere, position)) {
    return SampleSphere(*sphere, *shape.radiance, position, u);
  }
  const SurfaceHit point = source.emitter->Sample(u);
  const Vec3 to_light = point.position - position;
  const float distance2 = Dot(to_light, to_light);
  if (!(distance2 > 0)) {
    return {};
  }
  const float distance = std::sqrt(distance2);
  const Vec3 wi = to_light / distance;
  const float cosine = -Dot(point.face_normal, wi);
  if (cosine <= 1e-6F) {
    return {};
  }
  const float pdf = distance2 / (cosine * static_cast<float>(source.emitter->area()));
  return {wi, distance, *shape.radiance / pdf, pdf, false, point.offset};
}

Color World::Emission(const SurfaceHit& hit, Vec3 to_viewer) const {
  return hit.shape->radiance && Dot(hit.face_normal, to_viewer) > 0
             ? *hit.shape->radiance
             : Color{};
}

float World::EmissionPdf(const SurfaceHit& hit, Vec3 position) const {
  const int index = source_of_shape_[hit.shape_index];
  if (index < 0) {
    return 0;
  }
  const Source& source = sources_[static_cast<std::size_t>(index)];
  if (const auto* sphere = std::get_if<Sphere>(&hit.shape->geometry);
      sphere != nullptr && SeenAsCone(*sphere, position)) {
    const Vec3 d = sphere->center - position;
    const float sin2 = sphere->radius * sphere->radius / Dot(d, d);
    const float one_minus_cos = sin2 / (1 + std::sqrt(1 - sin2));
    return source.probability / (2 * kPi * one_minus_cos);
  }
  const Vec3 to_light = hit.position - position;
  const float distance2 = Dot(to_light, to_light);
  const float cosine =
      -Dot(hit.face_normal, to_light) / std::sqrt(std::max(distance2, 1e-30F));
  if (cosine <= 1e-6F) {
    return 0;
  }
  return source.probability * distance2 /
         (cosine * static_cast<float>(source.emitter->area()));
}

Color World::Background(Vec3 direction) const {
  Color sum;
  for (const std::size_t i : backgrounds_) {
    const auto& any = sources_[i].light->source;
    const auto* constant = std::get_if<ConstantLight>(&any);
    sum += constant != nullptr
               ? constant->radiance
               : std::get<EnvironmentLight>(any).environment->Radiance(direction);
  }
  return sum;
}

float World::BackgroundPdf(Vec3 side, Vec3 wi) const {
  const float constant_pdf =
      side == Vec3{} ? kUniformSpherePdf : CosineHemispherePdf(Dot(side, wi));
  float sum = 0;
  for (const std::size_t i : backgrounds_) {
    const auto* far = std::get_if<EnvironmentLight>(&sources_[i].light->source);
    sum += sources_[i].probability *
           (far != nullptr ? far->environment->Pdf(wi) : constant_pdf);
  }
  return sum;
}

}  // namespace nacre::render
