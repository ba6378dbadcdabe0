#include "render/shape.h"

#include "render/warp.h"

#include <algorithm>
#include <cmath>

namespace nacre::render {
namespace {

// A position is a sum of three products, each rounded to 2⁻²⁴ of its size; Embree's own
// error is of the same order. Sixteen times that is safe and far below what is seen.
constexpr float kOffset = 0x1p-20F;

float MaxAbs(Vec3 v) {
  return std::max(std::abs(v.x), std::max(std::abs(v.y), std::abs(v.z)));
}

// ∂p/∂u and ∂p/∂v of a triangle; false if the uv span no area.
bool MeshTangents(const SurfaceHit& hit, Vec3& dpdu, Vec3& dpdv) {
  const auto& mesh = std::get<TriangleMesh>(hit.shape->geometry);
  if (mesh.uvs.empty()) {
    return false;
  }
  const auto& t = mesh.triangles[hit.triangle];
  const Vec3 e1 = mesh.positions[t[1]] - mesh.positions[t[0]];
  const Vec3 e2 = mesh.positions[t[2]] - mesh.positions[t[0]];
  const float du1 = mesh.uvs[t[1]].x - mesh.uvs[t[0]].x;
  const float dv1 = mesh.uvs[t[1]].y - mesh.uvs[t[0]].y;
  const float du2 = mesh.uvs[t[2]].x - mesh.uvs[t[0]].x;
  const float dv2 = mesh.uvs[t[2]].y - mesh.uvs[t[0]].y;
  const float determinant = du1 * dv2 - dv1 * du2;
  const float size = std::abs(du1 * dv2) + std::abs(dv1 * du2);
  if (!(std::abs(determinant) > 1e-6F * size)) {
    return false;
  }
  dpdu = (e1 * dv2 - e2 * dv1) / determinant;
  dpdv = (e2 * du1 - e1 * du2) / determinant;
  return true;
}

bool SphereTangents(const SurfaceHit& hit, Vec3& dpdu, Vec3& dpdv) {
  const auto& sphere = std::get<Sphere>(hit.shape->geometry);
  const Vec3 local = sphere.axes.ToLocal(hit.position - sphere.center);
  const float around = std::hypot(local.x, local.y);
  if (!(around > 1e-6F * sphere.radius)) {
    return false;  // a pole
  }
  dpdu = sphere.axes.ToWorld({-local.y, local.x, 0}) * (2 * kPi);
  dpdv = sphere.axes.ToWorld(
             {-local.x * local.z / around, -local.y * local.z / around, around}) *
         kPi;
  return true;
}

}  // namespace

SurfaceHit MeshPoint(const Shape& shape, std::uint32_t triangle, Vec2 barycentric) {
  const auto& mesh = std::get<TriangleMesh>(shape.geometry);
  const auto& t = mesh.triangles[triangle];
  const float b1 = barycentric.x;
  const float b2 = barycentric.y;
  const float b0 = 1 - b1 - b2;
  const Vec3 p0 = mesh.positions[t[0]];
  const Vec3 e1 = mesh.positions[t[1]] - p0;
  const Vec3 e2 = mesh.positions[t[2]] - p0;
  SurfaceHit hit;
  hit.shape = &shape;
  hit.triangle = triangle;
  hit.barycentric = barycentric;
  hit.position = p0 + e1 * b1 + e2 * b2;
  hit.face_normal = Normalized(Cross(e1, e2));
  hit.normal = hit.face_normal;
  if (!mesh.normals.empty()) {
    const Vec3 sum =
        mesh.normals[t[0]] * b0 + mesh.normals[t[1]] * b1 + mesh.normals[t[2]] * b2;
    const float length = Length(sum);
    if (length > 0) {
      hit.normal = sum / length;
    }
    // Which side is out is the normals' to say, not the winding's.
    if (Dot(hit.normal, hit.face_normal) < 0) {
      hit.face_normal = -hit.face_normal;
    }
  }
  hit.offset = kOffset * (MaxAbs(p0) + MaxAbs(e1) + MaxAbs(e2));
  hit.uv = barycentric;
  if (!mesh.uvs.empty()) {
    hit.uv = {b0 * mesh.uvs[t[0]].x + b1 * mesh.uvs[t[1]].x + b2 * mesh.uvs[t[2]].x,
              b0 * mesh.uvs[t[0]].y + b1 * mesh.uvs[t[1]].y + b2 * mesh.uvs[t[2]].y};
  }
  return hit;
}

SurfaceHit Moved(const SurfaceHit& hit, const Transform& to_world) {
  SurfaceHit moved = hit;
  moved.position = to_world.Point(hit.position);
  moved.face_normal = to_world.Normal(hit.face_normal);
  moved.normal = to_world.Normal(hit.normal);
  moved.offset = Length(to_world.Vector(hit.face_normal)) * hit.offset +
                 kOffset * MaxAbs(moved.position);
  return moved;
}

float SurfaceOffset(const Sphere& sphere) {
  return kOffset * (MaxAbs(sphere.center) + sphere.radius);
}

SurfaceHit SpherePoint(const Shape& shape, Vec3 near_point) {
  const auto& sphere = std::get<Sphere>(shape.geometry);
  const Vec3 outward = Normalized(near_point - sphere.center);
  SurfaceHit hit;
  hit.shape = &shape;
  hit.position = sphere.center + outward * sphere.radius;
  hit.face_normal = sphere.inward ? -outward : outward;
  hit.normal = hit.face_normal;
  hit.offset = SurfaceOffset(sphere);
  const Vec3 local = sphere.axes.ToLocal(outward);
  const float longitude = std::atan2(local.y, local.x) / (2 * kPi);
  hit.uv = {longitude < 0 ? longitude + 1 : longitude,
            1 - std::acos(std::clamp(local.z, -1.0F, 1.0F)) * kInvPi};
  return hit;
}

void SetTangents(SurfacePoint& point, Vec3 along_u, Vec3 along_v) {
  const Vec3 tangent = along_u - point.normal * Dot(point.normal, along_u);
  const float length = Length(tangent);
  if (length > 0) {
    point.tangent_u = tangent / length;
    const Vec3 side = Cross(point.normal, point.tangent_u);
    point.tangent_v = Dot(side, along_v) < 0 ? -side : side;
    return;
  }
  const Frame frame(point.normal);
  point.tangent_u = frame.s;
  point.tangent_v = frame.t;
}

SurfacePoint ToSurfacePoint(const SurfaceHit& hit, float mm_per_unit) {
  SurfacePoint point;
  point.position_mm = hit.position * mm_per_unit;
  point.normal = hit.normal;
  point.uv = hit.uv;
  Vec3 dpdu;
  Vec3 dpdv;
  const bool mesh = std::holds_alternative<TriangleMesh>(hit.shape->geometry);
  if (!(mesh ? MeshTangents(hit, dpdu, dpdv) : SphereTangents(hit, dpdu, dpdv))) {
    dpdu = {};
    dpdv = {};
  }
  SetTangents(point, dpdu, dpdv);
  point.stretch_mm = Vec3{Dot(dpdu, point.tangent_u),
                          Dot(dpdv, point.tangent_u),
                          Dot(dpdv, point.tangent_v)} *
                     mm_per_unit;
  return point;
}

AreaSampler::AreaSampler(const Shape& shape) : shape_(&shape) {
  if (const auto* sphere = std::get_if<Sphere>(&shape.geometry)) {
    const double radius = static_cast<double>(sphere->radius);
    area_ = 4 * std::numbers::pi * radius * radius;
    return;
  }
  const auto& mesh = std::get<TriangleMesh>(shape.geometry);
  cumulative_.reserve(mesh.triangles.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    area_ += static_cast<double>(mesh.TriangleArea(i));
    cumulative_.push_back(area_);
  }
}

SurfaceHit AreaSampler::Sample(Vec2 u) const {
  if (const auto* sphere = std::get_if<Sphere>(&shape_->geometry)) {
    return SpherePoint(*shape_, sphere->center + SquareToSphere(u) * sphere->radius);
  }
  const double area = static_cast<double>(u.x) * area_;
  const auto found = std::upper_bound(cumulative_.begin(), cumulative_.end(), area);
  const auto i = static_cast<std::size_t>(
      std::min(found - cumulative_.begin(),
               static_cast<std::ptrdiff_t>(cumulative_.size()) - 1));
  const double before = i > 0 ? cumulative_[i - 1] : 0.0;
  const double fraction = (area - before) / (cumulative_[i] - before);
  return MeshPoint(*shape_,
                   static_cast<std::uint32_t>(i),
                   SquareToTriangle({static_cast<float>(fraction), u.y}));
}

}  // namespace nacre::render
