#include "render/integrators/caustic_photons.h"

#include "core/parallel.h"

#include <algorithm>
#include <cmath>

namespace nacre::render {
namespace {

constexpr std::int64_t kPhotonBlock = 4096;

// Before what light bends through glass is forgotten.
constexpr int kMostBounces = 64;

// Unless told, the radius of the first map is this part of the picture's width, as far
// away as the scene is large.
constexpr float kRadiusOfScene = 0.005F;

}  // namespace

bool CarriesPhotons(const Shape& shape) {
  return shape.bsdf != nullptr && shape.bsdf->IsDelta() && !shape.instanced;
}

CausticPhotons::CausticPhotons(const World& world,
                               const PhotonSettings& settings,
                               int max_depth)
    : world_(world), settings_(settings), max_depth_(max_depth) {
  if (!(settings_.initial_radius > 0)) {
    settings_.initial_radius = kRadiusOfScene * world.geometry().radius();
  }
  for (const Shape& shape : world.scene().shapes) {
    if (CarriesPhotons(shape)) {
      AreaSampler area(shape);
      const double before = targets_.empty() ? 0 : targets_.back().cumulative;
      const double cumulative = before + area.area();
      targets_.push_back({std::move(area), cumulative});
    }
  }
}

float CausticPhotons::Radius(std::int64_t index) const {
  // r²ₙ₊₁ / r²ₙ = (n + α) / (n + 1), n from 1 [Knaus11, eq. 15].
  const double alpha = static_cast<double>(settings_.alpha);
  double log_ratio = 0;
  for (std::int64_t n = 1; n <= index; ++n) {
    const auto k = static_cast<double>(n);
    log_ratio += std::log((k + alpha) / (k + 1));
  }
  return settings_.initial_radius * static_cast<float>(std::exp(0.5 * log_ratio));
}

PhotonMap CausticPhotons::Map(std::int64_t index,
                              std::uint64_t seed,
                              int thread_count) const {
  std::vector<Photon> photons;
  if (!targets_.empty() && world_.light_count() > 0) {
    const std::uint64_t own =
        MixSeed(MixSeed(seed, 0xCA57), static_cast<std::uint64_t>(index));
    const std::int64_t blocks = (settings_.count + kPhotonBlock - 1) / kPhotonBlock;
    std::vector<std::vector<Photon>> found(static_cast<std::size_t>(blocks));
    ParallelFor(blocks, thread_count, [&](std::int64_t block) {
      const std::int64_t end =
          std::min<std::int64_t>(settings_.count, (block + 1) * kPhotonBlock);
      for (std::int64_t n = block * kPhotonBlock; n < end; ++n) {
        Trace(own, n, found[static_cast<std::size_t>(block)]);
      }
    });
    for (const std::vector<Photon>& block : found) {
      photons.insert(photons.end(), block.begin(), block.end());
    }
  }
  return {std::move(photons), Radius(index)};
}

// From a place on glass or a mirror to a light, backwards: what arrives there is what
// any light sends, without a way of its own to sample each.
void CausticPhotons::Trace(std::uint64_t seed,
                           std::int64_t number,
                           std::vector<Photon>& found) const {
  Sampler sampler(seed, static_cast<std::uint32_t>(number));
  const double area = targets_.back().cumulative;
  const double wanted = static_cast<double>(sampler.Next1D()) * area;
  const auto target =
      std::find_if(targets_.begin(), targets_.end() - 1, [&](const Target& t) {
        return wanted < t.cumulative;
      });
  const SurfaceHit hit = target->area.Sample(sampler.Next2D());
  const float u_light = world_.light_count() > 1 ? sampler.Next1D() : 0;
  const LightSample light =
      world_.SampleLight(hit.position, {}, u_light, sampler.Next2D());
  const float cosine = std::abs(Dot(hit.face_normal, light.wi));
  if (!(light.pdf > 0) || !(cosine > 0) ||
      world_.geometry().Occluded(ShadowRay(hit, light))) {
    return;
  }
  Photon photon;
  photon.wi = light.wi;
  photon.edges = 1;
  photon.flux_w =
      light.radiance *
      (cosine * static_cast<float>(area / static_cast<double>(settings_.count)));
  Follow(photon, hit, sampler, found);
}

void CausticPhotons::Follow(Photon photon,
                            SurfaceHit hit,
                            Sampler& sampler,
                            std::vector<Photon>& found) const {
  for (int bounce = 0; bounce < kMostBounces; ++bounce) {
    const Frame frame(hit.normal);
    const Vec3 from = frame.ToLocal(photon.wi);
    const float u_lobe = sampler.Next1D();
    const BsdfSample sample =
        hit.shape->bsdf->Sample(from, hit.uv, u_lobe, sampler.Next2D());
    const Vec3 to = frame.ToWorld(sample.wi);
    const float along = Dot(hit.face_normal, to);
    if (!(sample.pdf > 0) || sample.wi.z * along <= 0 ||
        (max_depth_ >= 0 && photon.edges >= max_depth_)) {
      return;
    }
    // Radiance changes with the square of the index, flux doesn't; and shading normals
    // aren't symmetric [Veach97, section 5.3].
    const float facing = Dot(hit.face_normal, photon.wi);
    const float shading = std::abs(from.z * along / (facing * sample.wi.z));
    photon.flux_w *= sample.weight * (sample.eta * sample.eta * shading);
    if (!std::isfinite(photon.flux_w.x + photon.flux_w.y + photon.flux_w.z)) {
      return;
    }
    const Ray ray{OffsetOrigin(hit, to), to};
    ++photon.edges;
    if (!world_.geometry().Intersect(ray, hit) || hit.shape->bsdf == nullptr) {
      return;
    }
    photon.wi = -to;
    if (CarriesPhotons(*hit.shape)) {
      continue;
    }
    if (!hit.shape->bsdf->IsDelta()) {
      photon.position = hit.position;
      photon.normal = hit.normal;
      found.push_back(photon);
    }
    return;
  }
}

}  // namespace nacre::render
