#include "render/integrators/path.h"

#include "core/fresnel.h"
#include "render/bsdf/fresnel.h"
#include "render/integrators/caustic_photons.h"
#include "render/integrators/path_state.h"

#include <cmath>

namespace nacre::render {
namespace {

// What a lobe of less than a tenth of a steradian shows can be made out.
constexpr float kSharpPdf = 10;
constexpr float kInfinity = std::numeric_limits<float>::infinity();
// What is dimmed to less than this needn't be right to a percent.
constexpr float kSharpThroughput = 0.15F;
// Paths that bring less than this go on seldom, however short they are.
constexpr float kLittleWeight = 0.1F;

// Where light may come from: World::SampleLight's `side`.
Vec3 LitSide(const SurfaceHit& hit, Vec3 wo) {
  if (hit.shape->bsdf->Transmits()) {
    return {};
  }
  return wo.z > 0 ? hit.normal : -hit.normal;
}

// The shading normal, turned to the viewer in their common plane where it turns away
// from it although the surface doesn't: at the silhouette of a coarse smooth mesh,
// which would be black. Its cosine is at least half the surface's, so that nothing
// changes where the mesh is fine.
Vec3 TowardsViewer(const SurfaceHit& hit, Vec3 to_viewer) {
  const float at_surface = Dot(hit.face_normal, to_viewer);
  const float least = 0.5F * at_surface;
  const float cosine = Dot(hit.normal, to_viewer);
  if (at_surface >= 0 ? cosine >= least : cosine <= least) {
    return hit.normal;
  }
  const Vec3 across = hit.normal - to_viewer * cosine;
  const float length = Length(across);
  return length > 0
             ? to_viewer * least + across * (std::sqrt(1 - least * least) / length)
             : hit.face_normal;
}

}  // namespace

PathTracer::PathTracer(const World& world,
                       const ExitanceSources& exitances,
                       const IntegratorSettings& settings)
    : world_(world), exitances_(exitances), settings_(settings) {
  for (const Shape& shape : world.scene().shapes) {
    has_media_ = has_media_ || shape.interior != nullptr || shape.exterior != nullptr;
    const double eta = shape.translucency
                           ? static_cast<double>(shape.translucency->model->Eta())
                           : 1.0;
    exit_scale_.push_back(
        static_cast<float>(std::numbers::inv_pi / ExitNormalization(eta)));
  }
}

PathTracer::Result PathTracer::Radiance(const Ray& ray,
                                        Sampler& sampler,
                                        PathCounters& counters) const {
  const bool direct = settings_.kind == IntegratorSettings::Kind::kDirect;
  State state{.ray = ray,
              .sampler = sampler,
              .counters = counters,
              .max_depth = direct ? 2 : settings_.max_depth,
              .count_emission = !settings_.hide_emitters,
              .from_camera = true};
  Trace(state);
  return {state.radiance, state.alpha};
}

Color PathTracer::IndirectRadiance(const Ray& ray,
                                   Sampler& sampler,
                                   PathCounters& counters) const {
  State state{.ray = ray,
              .sampler = sampler,
              .counters = counters,
              .depth = 2,
              .max_depth = settings_.max_depth,
              .count_emission = false,
              .sight = Sight::kBlurred};
  Trace(state);
  return state.radiance;
}

void PathTracer::Trace(State& state) const {
  const auto deeper = [&] {
    return state.max_depth < 0 || state.depth < state.max_depth;
  };
  while (state.max_depth < 0 || state.depth <= state.max_depth) {
    ++state.counters.rays;
    SurfaceHit hit;
    const bool found = world_.geometry().Intersect(state.ray, hit);
    if (state.medium != nullptr) {
      const MediumEvent event = CrossMedium(state, found ? hit.distance : kInfinity);
      if (event == MediumEvent::kScattered) {
        continue;
      }
      if (event == MediumEvent::kEnded) {
        return;
      }
    }
    if (!found) {
      if (CountsEmission(state)) {
        const float other =
            state.delta ? 0 : world_.BackgroundPdf(state.side, state.ray.direction);
        const float weight = state.delta ? 1 : PowerHeuristic(state.pdf, other);
        state.radiance +=
            state.throughput * world_.Background(state.ray.direction) * weight;
      }
      return;
    }
    if (has_media_ && IsBoundaryOfMedia(*hit.shape)) {
      state.medium = MediumBeyond(hit, state.ray.direction, state.medium);
      state.ray = {OffsetOrigin(hit, state.ray.direction), state.ray.direction};
      continue;
    }
    if (hit.shape->hidden && state.from_camera) {
      state.ray = {OffsetOrigin(hit, state.ray.direction), state.ray.direction};
      continue;
    }
    state.alpha = 1;
    const Vec3 to_viewer = -state.ray.direction;
    hit.normal = TowardsViewer(hit, to_viewer);
    if (hit.shape->radiance && CountsEmission(state)) {
      const float other = state.delta ? 0 : world_.EmissionPdf(hit, state.origin);
      const float weight = state.delta ? 1 : PowerHeuristic(state.pdf, other);
      state.radiance += state.throughput * world_.Emission(hit, to_viewer) * weight;
    }
    if (exitances_[hit.shape_index] != nullptr && Dot(hit.face_normal, to_viewer) > 0) {
      ++state.counters.exitances;
      state.radiance += state.throughput * TranslucentRadiance(state, hit, to_viewer);
    }
    if (!deeper() || hit.shape->bsdf == nullptr) {
      return;
    }
    const Frame frame(hit.normal);
    const Vec3 wo = frame.ToLocal(to_viewer);
    if (!hit.shape->bsdf->IsDelta()) {
      AddDirectLight(state, hit, frame, wo);
      AddPhotons(state, hit, frame, wo);
    }
    if (!Continue(state, hit, frame, wo)) {
      return;
    }
  }
}

bool PathTracer::CountsEmission(const State& state) const {
  const bool by_photons = photons_ != nullptr && state.from_shown && state.carried;
  return state.count_emission && !by_photons;
}

void PathTracer::AddPhotons(State& state,
                            const SurfaceHit& hit,
                            const Frame& frame,
                            Vec3 wo) const {
  if (photons_ == nullptr) {
    return;
  }
  const int most = state.max_depth < 0 ? -1 : state.max_depth - state.depth;
  state.radiance += state.throughput * photons_->Radiance(hit, frame, wo, most);
}

void PathTracer::AddDirectLight(State& state,
                                const SurfaceHit& hit,
                                const Frame& frame,
                                Vec3 wo) const {
  if (world_.light_count() == 0) {
    return;
  }
  const float u_light = world_.light_count() > 1 ? state.sampler.Next1D() : 0;
  const LightSample light = world_.SampleLight(
      hit.position, LitSide(hit, wo), u_light, state.sampler.Next2D());
  if (!(light.pdf > 0)) {
    return;
  }
  const Vec3 wi = frame.ToLocal(light.wi);
  // A shading normal must not let light through the true surface.
  if (wi.z * Dot(hit.face_normal, light.wi) <= 0) {
    return;
  }
  const BsdfValue bsdf = hit.shape->bsdf->Evaluate(wo, wi, hit.uv);
  if (IsBlack(bsdf.value)) {
    return;
  }
  ++state.counters.shadow_rays;
  const Color arriving = LightArriving(state, hit, light);
  const float weight = light.delta ? 1 : PowerHeuristic(light.pdf, bsdf.pdf);
  state.radiance += state.throughput * bsdf.value * arriving * weight;
}

// Russian roulette.
bool PathTracer::Survives(State& state) const {
  const float weight = MaxComponent(state.throughput) * state.eta_scale;
  if (state.depth >= settings_.rr_depth || weight < kLittleWeight) {
    const float survive = state.depth >= settings_.rr_depth
                              ? std::min(0.95F, weight)
                              : std::min(1.0F, weight / kLittleWeight);
    if (state.sampler.Next1D() >= survive) {
      return false;
    }
    state.throughput *= 1 / survive;
  }
  return true;
}

bool PathTracer::Continue(State& state,
                          const SurfaceHit& hit,
                          const Frame& frame,
                          Vec3 wo) const {
  const float u_lobe = state.sampler.Next1D();
  const BsdfSample sample =
      hit.shape->bsdf->Sample(wo, hit.uv, u_lobe, state.sampler.Next2D());
  if (!(sample.pdf > 0) || IsBlack(sample.weight)) {
    return false;
  }
  const Vec3 wi = frame.ToWorld(sample.wi);
  if (sample.wi.z * Dot(hit.face_normal, wi) <= 0) {
    return false;
  }
  state.throughput *= sample.weight;
  state.eta_scale *= sample.eta * sample.eta;
  if (!Survives(state)) {
    return false;
  }
  state.delta = sample.delta;
  state.carried = photons_ != nullptr && CarriesPhotons(*hit.shape);
  state.from_shown = state.carried ? state.from_shown : !sample.delta;
  if (!sample.delta && sample.pdf <= kSharpPdf) {
    state.sight = Sight::kBlurred;
  } else if (state.sight == Sight::kSharp &&
             MaxComponent(state.throughput) <= kSharpThroughput) {
    state.sight = Sight::kDim;
  }
  state.pdf = sample.pdf;
  state.origin = hit.position;
  state.side = LitSide(hit, wo);
  state.count_emission = true;
  state.from_camera = false;
  state.ray = {OffsetOrigin(hit, wi), wi};
  if (has_media_ && sample.wi.z * wo.z < 0) {
    state.medium = MediumBeyond(hit, wi, state.medium);
  }
  ++state.depth;
  return true;
}

// L_o = M F_t(η, ω_o) / (π c(η)).
Color PathTracer::TranslucentRadiance(State& state,
                                      const SurfaceHit& hit,
                                      Vec3 to_viewer) const {
  const float cosine = std::min(1.0F, std::abs(Dot(hit.normal, to_viewer)));
  const float transmitted =
      1 - FresnelDielectric(cosine, hit.shape->translucency->model->Eta());
  const Color exitance = exitances_[hit.shape_index]->At(
      hit, {state.sampler, state.counters, state.sight});
  const TexturePtr& scale = hit.shape->translucency->exit_scale;
  return (scale != nullptr ? exitance * scale->At(hit.uv) : exitance) *
         (transmitted * exit_scale_[hit.shape_index]);
}

}  // namespace nacre::render
