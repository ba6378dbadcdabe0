#include "render/integrators/reference.h"

#include "render/warp.h"

#include <algorithm>
#include <cmath>

namespace nacre::render {
namespace {

// How often each way of finding a place is taken: three axes, then the whole surface.
constexpr std::array<float, 4> kShare{0.5F, 0.2F, 0.2F, 0.1F};

// Surfaces along one line, at most: a bound, not a limit that scenes meet.
constexpr int kMostSurfaces = 256;

}  // namespace

struct ReferenceExitance::Place {
  SurfacePoint point;
  std::array<Vec3, 3> axes;
};

ReferenceExitance::ReferenceExitance(const World& world,
                                     std::uint32_t shape_index,
                                     const PathTracer& tracer,
                                     bool indirect)
    : world_(world),
      shape_index_(shape_index),
      translucency_(*world.scene().shapes[shape_index].translucency),
      light_(world,
             tracer,
             translucency_.model->Eta(),
             indirect && translucency_.indirect),
      area_(world.scene().shapes[shape_index]),
      area_mm2_(static_cast<float>(area_.area()) * translucency_.mm_per_unit *
                translucency_.mm_per_unit),
      spread_(translucency_.model->Spread()) {}

Color ReferenceExitance::At(const SurfaceHit& hit, const ExitanceQuery& query) const {
  ++query.counters.evaluations;
  Place x_o{ToSurfacePoint(hit, translucency_.mm_per_unit), {}};
  const Frame frame(x_o.point.normal);
  x_o.axes = {frame.n, frame.s, frame.t};

  float u = query.sampler.Next1D();
  const Vec2 uv = query.sampler.Next2D();
  std::size_t way = 0;
  while (way < 3 && u >= kShare[way]) {
    u -= kShare[way];
    ++way;
  }
  if (way == 3) {
    return FromPlace(x_o, area_.Sample(uv), query);
  }
  const Frame around(x_o.axes[way]);
  const float mm = translucency_.mm_per_unit;
  const float r = spread_.Sample(uv.x) / mm;
  const float reach = spread_.reach_mm() / mm;
  const float half = std::sqrt(std::max(0.0F, reach * reach - r * r));
  const float phi = 2 * kPi * uv.y;
  const Vec3 middle =
      hit.position + (around.s * std::cos(phi) + around.t * std::sin(phi)) * r;
  Ray line{middle - around.n * half, around.n, 0, 2 * half};
  // Beyond the scene there is nothing to meet.
  const Vec3 to_scene = world_.geometry().center() - middle;
  const float along = Dot(to_scene, around.n);
  const float nearest = std::max(-half, along - 1.01F * world_.geometry().radius());
  line.origin = middle + around.n * nearest;
  line.t_max = std::min(half, along + 1.01F * world_.geometry().radius()) - nearest;

  ++query.counters.probes;
  Color sum;
  for (int n = 0;; ++n) {
    SurfaceHit found;
    if (!(line.t_max > line.t_min) || !world_.geometry().Intersect(line, found)) {
      return sum;
    }
    if (n == kMostSurfaces) {
      ++query.counters.probes_cut;
      return sum;
    }
    if (found.shape_index == shape_index_) {
      sum += FromPlace(x_o, found, query);
    }
    line.t_min = std::max(std::nextafter(found.distance, line.t_max),
                          found.distance + found.offset);
  }
}

// A line through the plane across an axis meets a surface as often as the surface is
// seen from there: |cos|.
float ReferenceExitance::Density(const Place& x_o,
                                 const SurfaceHit& hit_i,
                                 Vec3 d_mm) const {
  float density = kShare[3] / area_mm2_;
  const float distance2 = Dot(d_mm, d_mm);
  if (distance2 < spread_.reach_mm() * spread_.reach_mm()) {
    for (std::size_t way = 0; way < 3; ++way) {
      const float along = Dot(d_mm, x_o.axes[way]);
      const float across = std::sqrt(std::max(0.0F, distance2 - along * along));
      density += kShare[way] * spread_.Pdf(across) *
                 std::abs(Dot(hit_i.face_normal, x_o.axes[way]));
    }
  }
  return density;
}

Color ReferenceExitance::FromPlace(const Place& x_o,
                                   const SurfaceHit& hit_i,
                                   const ExitanceQuery& query) const {
  const SurfacePoint x_i = ToSurfacePoint(hit_i, translucency_.mm_per_unit);
  const Vec3 d_mm = x_i.position_mm - x_o.point.position_mm;
  Color weight = translucency_.model->Rd(x_i, x_o.point) / Density(x_o, hit_i, d_mm);
  // What would bring little is asked seldom.
  constexpr float kLittle = 0.2F;
  const float survive = std::min(1.0F, MaxComponent(weight) / kLittle);
  if (!(survive > 0) || (survive < 1 && query.sampler.Next1D() >= survive)) {
    return {};
  }
  weight *= 1 / survive;
  return weight * light_.OneLight(hit_i, query.sampler, query.counters);
}

}  // namespace nacre::render
