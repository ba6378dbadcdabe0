#pragma once

#include "render/bsdf/bsdfs.h"
#include "render/medium.h"
#include "render/mesh.h"
#include "render/subsurface/subsurface.h"
#include "render/transform.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace nacre::render {

struct Sphere {
  Vec3 center;
  float radius = 1;
  bool inward = false;  ///< the normal points to the centre
  /// Rotates world directions to those of which uv is the longitude / 2π and the
  /// polar angle / π, measured from −z so that v grows with z.
  Frame axes{Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}};
};

/// Light that enters a shape spreads inside it and leaves elsewhere.
struct Translucency {
  std::shared_ptr<const SubsurfaceModel> model;
  std::string name;             ///< for messages: the preset, or the model
  float mm_per_unit = 1;        ///< millimetres of the material a scene unit
  bool indirect = true;         ///< gathers indirect light too (`irrIndirect`)
  int irradiance_samples = 16;  ///< a patch (`irrSamples`)
  /// What exitances are times where they are seen; null: 1. Sharp, where exitances are
  /// interpolated.
  TexturePtr exit_scale{};
  float core_mm = 0;  ///< of a measured material: what a lit point reaches
};

struct Shape {
  std::string name;
  std::variant<TriangleMesh, Sphere> geometry;
  BsdfPtr bsdf;                   ///< null: reflects nothing
  std::optional<Color> radiance;  ///< emitted on the outside
  float sampling_weight = 1;      ///< of the emission, among the lights
  bool hidden = false;            ///< the camera looks through it
  std::optional<Translucency> translucency;
  MediumPtr interior;  ///< behind the surface; null: what is outside is inside too
  MediumPtr exterior;
  bool instanced = false;  ///< is only where a `ShapeInstance` puts it
};

/// Shapes [first, first + count) of a scene once more, elsewhere. They neither shine
/// nor let light through: those are copied instead.
struct ShapeInstance {
  std::size_t first = 0;
  std::size_t count = 0;
  Transform to_world;
};

/// A point of a surface.
struct SurfaceHit {
  const Shape* shape = nullptr;
  std::uint32_t shape_index = 0;
  std::uint32_t triangle = 0;
  float distance = 0;
  Vec3 position;
  Vec3 face_normal;  ///< unit, outward; of the geometry
  Vec3 normal;       ///< unit, outward; interpolated, for shading
  Vec2 uv;           ///< of a mesh without: the barycentric coordinates
  Vec2 barycentric;  ///< of corners 1 and 2, on a mesh
  float offset = 0;  ///< moves a point safely off the surface: some errors of position
};

/// Completes a hit of `shape` (whose index is the caller's): for a mesh from triangle
/// and barycentric coordinates of corners 1 and 2, for a sphere from a point close to
/// it.
SurfaceHit MeshPoint(const Shape& shape, std::uint32_t triangle, Vec2 barycentric);
SurfaceHit SpherePoint(const Shape& shape, Vec3 near_point);

/// A hit of a shape as it is in an instance.
SurfaceHit Moved(const SurfaceHit& hit, const Transform& to_world);

/// SurfaceHit::offset of any point of a sphere.
float SurfaceOffset(const Sphere& sphere);

/// The hit as models of translucency want it: in millimetres, with tangents along u and
/// v made orthonormal to the shading normal. Without usable uv, some frame.
SurfacePoint ToSurfacePoint(const SurfaceHit& hit, float mm_per_unit);

/// Points uniform in area over a shape.
class AreaSampler {
 public:
  explicit AreaSampler(const Shape& shape);
  double area() const { return area_; }  ///< scene units squared
  /// u.x chooses the triangle and, stretched to it, a place in it.
  SurfaceHit Sample(Vec2 u) const;

 private:
  const Shape* shape_;
  std::vector<double> cumulative_;  ///< area up to and with a triangle
  double area_ = 0;
};

}  // namespace nacre::render
