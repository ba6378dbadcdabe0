#include "render/lit_points.h"

#include "core/parallel.h"
#include "render/bsdf/fresnel.h"
#include "render/warp.h"

#include <algorithm>
#include <cmath>

namespace nacre::render {
namespace {

constexpr std::int64_t kBlock = 256;

// Where the points are, before they see any light.
struct Placement {
  std::vector<std::uint32_t> triangle;  ///< empty for a sphere
  std::int64_t count = 0;
  double area = 0;  ///< scene units squared
};

// Triangle after triangle, as many points as its area deserves; remainders carry over,
// so that each stretch of the surface is off by less than one point.
Placement PlaceOnMesh(const TriangleMesh& mesh, double count) {
  Placement placement;
  placement.area = SurfaceArea(mesh);
  const double per_area = count / placement.area;
  double due = 0.5;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    due += per_area * static_cast<double>(mesh.TriangleArea(i));
    const double whole = std::floor(due);
    due -= whole;
    placement.triangle.insert(placement.triangle.end(),
                              static_cast<std::size_t>(whole),
                              static_cast<std::uint32_t>(i));
  }
  placement.count = static_cast<std::int64_t>(placement.triangle.size());
  if (placement.count == 0) {  // a surface smaller than half a patch
    placement.triangle.push_back(0);
    placement.count = 1;
  }
  return placement;
}

SurfaceHit PlacePoint(const Shape& shape, const Placement& placement, std::int64_t i) {
  const Vec2 u = SobolPoint(static_cast<std::uint32_t>(i));
  if (const auto* sphere = std::get_if<Sphere>(&shape.geometry)) {
    return SpherePoint(shape, sphere->center + SquareToSphere(u) * sphere->radius);
  }
  const std::uint32_t triangle = placement.triangle[static_cast<std::size_t>(i)];
  return MeshPoint(shape, triangle, SquareToTriangle(u));
}

// One point's light. F_t(η, θ_i) of it enters.
class Gatherer {
 public:
  Gatherer(const World& world,
           const Translucency& translucency,
           const PathTracer& tracer,
           const LitPointOptions& options)
      : world_(world),
        tracer_(tracer),
        eta_(translucency.model->Eta()),
        indirect_(translucency.indirect && options.indirect),
        // The samples asked for are a patch's; its points share them.
        samples_(std::max(
            1,
            static_cast<int>(std::lround(translucency.irradiance_samples /
                                         std::max(1.0, options.points_per_patch))))) {}

  Color Entering(const SurfaceHit& hit,
                 std::uint64_t seed,
                 PathCounters& counters) const {
    Color sum;
    for (std::size_t light = 0; light < world_.light_count(); ++light) {
      const int samples = world_.IsDeltaLight(light) ? 1 : samples_;
      const std::uint64_t light_seed = MixSeed(seed, light);
      Color from_light;
      for (int k = 0; k < samples; ++k) {
        Sampler sampler(light_seed, static_cast<std::uint32_t>(k));
        from_light += Direct(hit, light, sampler.Next2D(), counters);
      }
      sum += from_light / static_cast<float>(samples);
    }
    if (indirect_) {
      const std::uint64_t indirect_seed = MixSeed(seed, world_.light_count());
      Color indirect;
      for (int k = 0; k < samples_; ++k) {
        Sampler sampler(indirect_seed, static_cast<std::uint32_t>(k));
        indirect += Indirect(hit, sampler, counters);
      }
      sum += indirect / static_cast<float>(samples_);
    }
    return sum;
  }

 private:
  Color Direct(const SurfaceHit& hit,
               std::size_t light,
               Vec2 u,
               PathCounters& counters) const {
    const LightSample sample = world_.SampleLight(light, hit.position, hit.normal, u);
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
  Color Indirect(const SurfaceHit& hit,
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

  const World& world_;
  const PathTracer& tracer_;
  float eta_;
  bool indirect_;
  int samples_;
};

}  // namespace

LitPoints SampleLitPoints(const World& world,
                          std::uint32_t shape_index,
                          const PathTracer& tracer,
                          const LitPointOptions& options) {
  const Shape& shape = world.scene().shapes[shape_index];
  const Translucency& translucency = *shape.translucency;
  const double mm = static_cast<double>(translucency.mm_per_unit);
  const double patch_mm = static_cast<double>(translucency.model->PatchSizeMm());
  const double area_mm2 = AreaSampler(shape).area() * mm * mm;

  LitPoints result;
  const double wanted =
      std::max(1.0, options.points_per_patch * area_mm2 / (patch_mm * patch_mm));
  result.capped = wanted > static_cast<double>(options.max_points);
  const double count = std::min(wanted, static_cast<double>(options.max_points));
  Placement placement;
  if (const auto* mesh = std::get_if<TriangleMesh>(&shape.geometry)) {
    placement = PlaceOnMesh(*mesh, count);
  } else {
    placement.count = static_cast<std::int64_t>(std::ceil(count));
  }
  result.area_mm2 = area_mm2;

  const Gatherer gatherer(world, translucency, tracer, options);
  const std::uint64_t seed = MixSeed(options.seed, shape_index);
  const float area_each =
      static_cast<float>(area_mm2 / static_cast<double>(placement.count));
  result.points.resize(static_cast<std::size_t>(placement.count));
  std::vector<PathCounters> counters(
      static_cast<std::size_t>((placement.count + kBlock - 1) / kBlock));
  ParallelForBlocks(placement.count,
                    kBlock,
                    options.thread_count,
                    [&](std::int64_t begin, std::int64_t end) {
                      PathCounters& block =
                          counters[static_cast<std::size_t>(begin / kBlock)];
                      for (std::int64_t i = begin; i < end; ++i) {
                        const SurfaceHit hit = PlacePoint(shape, placement, i);
                        LitPoint& lit = result.points[static_cast<std::size_t>(i)];
                        lit.point = ToSurfacePoint(hit, translucency.mm_per_unit);
                        lit.area_mm2 = area_each;
                        lit.flux_density = gatherer.Entering(
                            hit, MixSeed(seed, static_cast<std::uint64_t>(i)), block);
                      }
                    });
  for (const PathCounters& block : counters) {
    result.counters += block;
  }
  return result;
}

}  // namespace nacre::render
