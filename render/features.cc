#include "render/features.h"

#include "core/parallel.h"
#include "render/world.h"

#include <algorithm>
#include <cmath>

namespace nacre::render {
namespace {

constexpr std::uint32_t kFeatureSamples = 16;

ExrPart Part(const char* name, const Film& film, std::vector<std::string> channels) {
  ExrPart part;
  part.name = name;
  part.width = film.crop_width;
  part.height = film.crop_height;
  part.channels = std::move(channels);
  part.values.resize(3 * part.PixelCount());
  return part;
}

// One sample of what leaves, of white light from everywhere.
Color AlbedoOf(const SurfaceHit& hit, Vec3 to_viewer, Sampler& sampler) {
  const Frame frame(hit.normal);
  const float u_lobe = sampler.Next1D();
  const Vec2 u = sampler.Next2D();
  if (hit.shape->translucency && hit.shape->translucency->exit_scale != nullptr) {
    return hit.shape->translucency->exit_scale->At(hit.uv);
  }
  if (hit.shape->radiance || hit.shape->translucency || hit.shape->bsdf == nullptr) {
    return {1, 1, 1};
  }
  const BsdfSample sample =
      hit.shape->bsdf->Sample(frame.ToLocal(to_viewer), hit.uv, u_lobe, u);
  return sample.pdf > 0 ? sample.weight * (sample.eta * sample.eta) : Color{};
}

float Clamped(float value) {
  return std::isfinite(value) ? std::clamp(value, 0.0F, 1.0F) : 0.0F;
}

}  // namespace

FeatureImages FirstHitFeatures(const Scene& scene,
                               std::uint64_t seed,
                               int thread_count) {
  const Film& film = scene.film;
  const World world(scene, thread_count);
  FeatureImages images{Part("albedo", film, {"R", "G", "B"}),
                       Part("normal", film, {"X", "Y", "Z"})};
  ParallelFor(film.crop_height, thread_count, [&](std::int64_t y) {
    for (int x = 0; x < film.crop_width; ++x) {
      const auto pixel =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(film.crop_width) +
          static_cast<std::size_t>(x);
      Color albedo;
      Vec3 normal;
      for (std::uint32_t n = 0; n < kFeatureSamples; ++n) {
        Sampler sampler(MixSeed(seed, pixel), n);
        const Vec2 u = sampler.Next2D();
        const Vec2 position{
            static_cast<float>(film.crop_x + x) + u.x,
            static_cast<float>(film.crop_y + static_cast<int>(y)) + u.y};
        const Ray ray = CameraRay(scene.camera, position, film.width, film.height);
        SurfaceHit hit;
        if (world.geometry().Intersect(ray, hit)) {
          albedo += AlbedoOf(hit, -ray.direction, sampler);
          normal += hit.normal;
        }
      }
      constexpr float kShare = 1.0F / static_cast<float>(kFeatureSamples);
      for (std::size_t c = 0; c < 3; ++c) {
        const auto axis = static_cast<int>(c);
        images.albedo.Channel(c)[pixel] = Clamped(albedo[axis] * kShare);
        images.normal.Channel(c)[pixel] = normal[axis] * kShare;
      }
    }
  });
  return images;
}

}  // namespace nacre::render
