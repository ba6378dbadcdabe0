#include "render/shape.h"

#include "render/embree_scene.h"
#include "render/sampler.h"
#include "render/warp.h"

#include <gtest/gtest.h>

namespace nacre::render {
namespace {

Shape MeshShape(TriangleMesh mesh) {
  Shape shape;
  shape.geometry = std::move(mesh);
  return shape;
}

Shape SphereShape(Vec3 center, float radius) {
  Shape shape;
  shape.geometry = Sphere{.center = center, .radius = radius};
  return shape;
}

void ExpectNear(Vec3 a, Vec3 b, float tolerance) {
  EXPECT_NEAR(a.x, b.x, tolerance);
  EXPECT_NEAR(a.y, b.y, tolerance);
  EXPECT_NEAR(a.z, b.z, tolerance);
}

TEST(ShapeTest, RaysFindPlaceNormalAndUv) {
  const std::vector<Shape> shapes = {MeshShape(MakeRectangle()),
                                     SphereShape({0, 0, 5}, 2)};
  const EmbreeScene scene(shapes, {}, 1);
  SurfaceHit hit;
  ASSERT_TRUE(scene.Intersect({{0.5F, -0.25F, 1}, {0, 0, -1}}, hit));
  EXPECT_EQ(hit.shape_index, 0u);
  ExpectNear(hit.position, {0.5F, -0.25F, 0}, 1e-6F);
  ExpectNear(hit.normal, {0, 0, 1}, 1e-6F);
  EXPECT_NEAR(hit.uv.x, 0.75, 1e-6);
  EXPECT_NEAR(hit.uv.y, 0.375, 1e-6);
  ASSERT_TRUE(scene.Intersect({{0, 0, 1}, {0, 0, 1}}, hit));
  EXPECT_EQ(hit.shape_index, 1u);
  EXPECT_NEAR(hit.distance, 2, 1e-5);
  ExpectNear(hit.normal, {0, 0, -1}, 1e-6F);
  EXPECT_NEAR(hit.uv.y, 0, 1e-3);  // the south pole
  EXPECT_FALSE(scene.Intersect({{3, 0, 1}, {0, 0, -1}}, hit));
  EXPECT_TRUE(scene.Occluded({{0, 0, 1}, {0, 0, 1}}));
  EXPECT_FALSE(scene.Occluded({{0, 0, 1}, {0, 0, 1}, 0, 1.9F}));
}

TEST(ShapeTest, PointsMovedOffTheSurfaceDoNotSeeIt) {
  // Large, tilted and far from the origin: rounding at its worst.
  TriangleMesh mesh = MakeRectangle();
  for (Vec3& p : mesh.positions) {
    p = {p.x * 300 + 0.1F, p.x * 170 + p.y * 90 + 1000, p.y * 400 - 2000};
  }
  mesh.normals.clear();
  std::vector<Shape> shapes;
  shapes.push_back(MeshShape(std::move(mesh)));
  shapes.push_back(SphereShape({-4000, 10, 3}, 50));
  const EmbreeScene scene(shapes, {}, 1);
  for (std::uint32_t i = 0; i < 20000; ++i) {
    Sampler sampler(1, i);
    const AreaSampler area(shapes[i % 2]);
    const SurfaceHit hit = area.Sample(sampler.Next2D());
    const Vec3 local = SquareToCosineHemisphere(sampler.Next2D());
    const Vec3 direction = Frame(hit.face_normal).ToWorld(local);
    EXPECT_FALSE(scene.Occluded({OffsetOrigin(hit, direction), direction, 0, 40}))
        << i << ' ' << local.z;
  }
}

TEST(ShapeTest, TangentsFollowUvAndAreOrthonormal) {
  TriangleMesh mesh = MakeRectangle();
  mesh.uvs = {{0, 0}, {0, 1}, {1, 1}, {1, 0}};  // u along y, v along x: mirrored
  const Shape shape = MeshShape(std::move(mesh));
  const SurfacePoint point = ToSurfacePoint(MeshPoint(shape, 0, {0.2F, 0.3F}), 10);
  ExpectNear(point.tangent_u, {0, 1, 0}, 1e-6F);
  ExpectNear(point.tangent_v, {1, 0, 0}, 1e-6F);
  EXPECT_NEAR(point.position_mm.x, 10 * (-1 + 0.4F + 0.6F), 1e-5);
}

TEST(ShapeTest, WithoutUsableUvThereIsStillAFrame) {
  TriangleMesh none = MakeRectangle();
  none.uvs.clear();
  TriangleMesh collapsed = MakeRectangle();
  collapsed.uvs.assign(4, {0.3F, 0.3F});
  for (TriangleMesh& mesh : std::vector<TriangleMesh>{none, collapsed}) {
    const Shape shape = MeshShape(mesh);
    const SurfacePoint point = ToSurfacePoint(MeshPoint(shape, 1, {0.2F, 0.3F}), 1);
    EXPECT_NEAR(Length(point.tangent_u), 1, 1e-6);
    EXPECT_NEAR(Dot(point.tangent_u, point.normal), 0, 1e-6);
    EXPECT_NEAR(Dot(point.tangent_u, point.tangent_v), 0, 1e-6);
  }
}

TEST(ShapeTest, SphereTangentsPointEastAndNorth) {
  const Shape shape = SphereShape({1, 2, 3}, 2);
  const SurfaceHit hit = SpherePoint(shape, {3, 2, 3});
  const SurfacePoint point = ToSurfacePoint(hit, 1);
  ExpectNear(point.tangent_u, {0, 1, 0}, 1e-5F);
  ExpectNear(point.tangent_v, {0, 0, 1}, 1e-5F);
  EXPECT_NEAR(hit.uv.x, 0, 1e-6);
  EXPECT_NEAR(hit.uv.y, 0.5, 1e-6);
}

TEST(ShapeTest, TheNormalsSayWhichSideIsOut) {
  TriangleMesh mesh = MakeRectangle();
  mesh.normals.assign(4, {0, 0, -1});
  const Shape shape = MeshShape(std::move(mesh));
  EXPECT_EQ(MeshPoint(shape, 0, {0.2F, 0.2F}).face_normal, (Vec3{0, 0, -1}));
}

TEST(ShapeTest, AreaSamplingIsUniform) {
  TriangleMesh mesh = MakeRectangle();
  mesh.positions[2] = {3, 1, 0};  // triangles of areas 2 and 4
  mesh.positions[1] = {1, -1, 0};
  const Shape shape = MeshShape(std::move(mesh));
  const AreaSampler area(shape);
  EXPECT_NEAR(
      area.area(),
      static_cast<double>(std::get<TriangleMesh>(shape.geometry).TriangleArea(0) +
                          std::get<TriangleMesh>(shape.geometry).TriangleArea(1)),
      1e-6);
  int first = 0;
  constexpr int kCount = 1 << 14;
  for (std::uint32_t i = 0; i < kCount; ++i) {
    Sampler sampler(1, i);
    first += area.Sample(sampler.Next2D()).triangle == 0 ? 1 : 0;
  }
  const double share =
      static_cast<double>(std::get<TriangleMesh>(shape.geometry).TriangleArea(0)) /
      area.area();
  EXPECT_NEAR(first / static_cast<double>(kCount), share, 1e-3);
}

}  // namespace
}  // namespace nacre::render
