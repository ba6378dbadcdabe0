#include "render/entering_light.h"

#include "render/bsdf/fresnel.h"
#include "render/warp.h"

#include <algorithm>

namespace nacre::render {

Color EnteringLight::AllLights(const SurfaceHit& hit,
                               int samples,
                               std::uint64_t seed,
                               PathCounters& counters) const {
  Color sum;
  for (std::size_t light = 0; light < world_.light_count(); ++light) {
    const int count = world_.IsDeltaLight(light) ? 1 : samples;
    const std::uint64_t light_seed = MixSeed(seed, light);
    Color from_light;
    for (int k = 0; k < count; ++k) {
      Sampler sampler(light_seed, static_cast<std::uint32_t>(k));
      from_light +=
          Direct(hit,
                 world_.SampleLight(light, hit.position, hit.normal, sampler.Next2D()),
                 counters);
    }
    sum += from_light / static_cast<float>(count);
  }
  if (indirect_) {
    const std::uint64_t indirect_seed = MixSeed(seed, world_.light_count());
    Color indirect;
    for (int k = 0; k < samples; ++k) {
      Sampler sampler(indirect_seed, static_cast<std::uint32_t>(k));
      indirect += Indirect(hit, sampler, counters);
    }
    sum += indirect / static_cast<float>(samples);
  }
  return sum;
}

Color EnteringLight::OneLight(const SurfaceHit& hit,
                              Sampler& sampler,
                              PathCounters& counters) const {
  Color sum;
  if (world_.light_count() > 0) {
    const float u_light = world_.light_count() > 1 ? sampler.Next1D() : 0;
    sum +=
        Direct(hit,
               world_.SampleLight(hit.position, hit.normal, u_light, sampler.Next2D()),
               counters);
  }
  if (indirect_) {
    sum += Indirect(hit, sampler, counters);
  }
  return sum;
}

Color EnteringLight::Direct(const SurfaceHit& hit,
                            const LightSample& sample,
                            PathCounters& counters) const {
  const float cosine = std::min(1.0F, Dot(hit.normal, sample.wi));
  if (!(sample.pdf > 0) || cosine <= 0 || Dot(hit.face_normal, sample.wi) <= 0) {
    return {};
  }
  ++counters.shadow_rays;
  if (world_.geometry().Occluded(ShadowRay(hit, sample))) {
    return {};
  }
  return sample.radiance * (cosine * (1 - FresnelDielectric(cosine, eta_)));
}

// With density cos θ / π, so that the estimate of ∫ L F_t cos θ dω is π L F_t.
Color EnteringLight::Indirect(const SurfaceHit& hit,
                              Sampler& sampler,
                              PathCounters& counters) const {
  const Vec3 local = SquareToCosineHemisphere(sampler.Next2D());
  const Vec3 wi = Frame(hit.normal).ToWorld(local);
  if (Dot(hit.face_normal, wi) <= 0) {
    return {};
  }
  const Color radiance =
      tracer_.IndirectRadiance({OffsetOrigin(hit, wi), wi}, sampler, counters);
  return radiance * (kPi * (1 - FresnelDielectric(std::min(1.0F, local.z), eta_)));
}

}  // namespace nacre::render
