// What media between surfaces do to paths: free paths end in collisions [Jarosz08].
#include "render/integrators/path_state.h"

#include <limits>

namespace nacre::render {
namespace {

// Boundaries that one ray may cross: a bound on rounding, not on scenes.
constexpr int kMaxCrossings = 1000;

}  // namespace

bool IsBoundaryOfMedia(const Shape& shape) {
  return shape.bsdf == nullptr && !shape.radiance && !shape.translucency &&
         (shape.interior != nullptr || shape.exterior != nullptr);
}

const ParticipatingMedium* MediumBeyond(const SurfaceHit& hit,
                                        Vec3 direction,
                                        const ParticipatingMedium* medium) {
  const Shape& shape = *hit.shape;
  if (shape.interior == nullptr && shape.exterior == nullptr) {
    return medium;
  }
  return Dot(hit.face_normal, direction) < 0 ? shape.interior.get()
                                             : shape.exterior.get();
}

PathTracer::MediumEvent PathTracer::CrossMedium(State& state, float distance) const {
  const ParticipatingMedium& medium = *state.medium;
  const ParticipatingMedium::Step step =
      medium.SampleStep(state.ray, distance, state.throughput, state.sampler);
  state.throughput *= step.weight;
  if (IsBlack(state.throughput)) {
    return MediumEvent::kEnded;
  }
  if (!step.scattered) {
    return MediumEvent::kPassed;
  }
  state.alpha = 1;
  if (state.max_depth >= 0 && state.depth >= state.max_depth) {
    return MediumEvent::kEnded;
  }
  const Vec3 position = state.ray.origin + state.ray.direction * step.distance;
  AddLightInMedium(state, position);
  const Vec3 forward = state.ray.direction;
  const Vec3 onward = SamplePhase(medium.g(), forward, state.sampler.Next2D());
  if (!Survives(state)) {
    return MediumEvent::kEnded;
  }
  state.delta = false;
  state.sight = Sight::kBlurred;
  state.pdf = PhasePdf(medium.g(), Dot(forward, onward));
  state.origin = position;
  state.side = {};
  state.count_emission = true;
  state.ray = {position, onward};
  ++state.depth;
  return MediumEvent::kScattered;
}

void PathTracer::AddLightInMedium(State& state, Vec3 position) const {
  if (world_.light_count() == 0) {
    return;
  }
  const float u_light = world_.light_count() > 1 ? state.sampler.Next1D() : 0;
  const LightSample light =
      world_.SampleLight(position, {}, u_light, state.sampler.Next2D());
  if (!(light.pdf > 0)) {
    return;
  }
  SurfaceHit here;
  here.position = position;
  const float phase = PhasePdf(state.medium->g(), Dot(state.ray.direction, light.wi));
  const float weight = light.delta ? 1 : PowerHeuristic(light.pdf, phase);
  state.radiance += state.throughput *
                    LightThroughMedia(state, state.medium, ShadowRay(here, light)) *
                    light.radiance * (phase * weight);
}

Color PathTracer::LightArriving(State& state,
                                const SurfaceHit& hit,
                                const LightSample& light) const {
  const Ray ray = ShadowRay(hit, light);
  if (!has_media_) {
    ++state.counters.shadow_rays;
    return world_.geometry().Occluded(ray) ? Color{} : light.radiance;
  }
  const bool crosses =
      Dot(hit.face_normal, light.wi) * Dot(hit.face_normal, state.ray.direction) > 0;
  const ParticipatingMedium* const medium =
      crosses ? MediumBeyond(hit, light.wi, state.medium) : state.medium;
  return light.radiance * LightThroughMedia(state, medium, ray);
}

Color PathTracer::LightThroughMedia(State& state,
                                    const ParticipatingMedium* medium,
                                    Ray ray) const {
  Color left{1, 1, 1};
  for (int crossing = 0; crossing < kMaxCrossings; ++crossing) {
    ++state.counters.shadow_rays;
    SurfaceHit hit;
    const bool found = world_.geometry().Intersect(ray, hit);
    if (found && !IsBoundaryOfMedia(*hit.shape)) {
      return {};
    }
    if (medium != nullptr) {
      left *=
          medium->Transmittance(ray, found ? hit.distance : ray.t_max, state.sampler);
    }
    if (!found || IsBlack(left)) {
      return left;
    }
    medium = MediumBeyond(hit, ray.direction, medium);
    const Vec3 origin = OffsetOrigin(hit, ray.direction);
    ray = {origin, ray.direction, 0, ray.t_max - hit.distance};
  }
  return {};
}

}  // namespace nacre::render
