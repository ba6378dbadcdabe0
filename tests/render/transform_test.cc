#include "render/transform.h"

#include "core/error.h"

#include <gtest/gtest.h>

namespace nacre::render {
namespace {

void ExpectNear(Vec3 a, Vec3 b, float tolerance = 1e-6F) {
  EXPECT_NEAR(a.x, b.x, tolerance);
  EXPECT_NEAR(a.y, b.y, tolerance);
  EXPECT_NEAR(a.z, b.z, tolerance);
}

TEST(TransformTest, RotatesCounterClockwise) {
  ExpectNear(Transform::Rotate({0, 0, 1}, 90).Point({1, 0, 0}), {0, 1, 0});
  ExpectNear(Transform::Rotate({1, 0, 0}, 90).Point({0, 1, 0}), {0, 0, 1});
  ExpectNear(Transform::Rotate({0, 5, 0}, 90).Point({0, 0, 1}), {1, 0, 0});
  // About the diagonal, a third of a turn permutes the axes.
  ExpectNear(Transform::Rotate({1, 1, 1}, 120).Point({1, 2, 3}), {3, 1, 2});
}

TEST(TransformTest, AppliesTheRightFactorFirst) {
  const Transform t = Transform::Translate(1, 2, 3) * Transform::Scale(2, 2, 2);
  ExpectNear(t.Point({1, 1, 1}), {3, 4, 5});
  ExpectNear(t.Vector({1, 1, 1}), {2, 2, 2});
}

TEST(TransformTest, LooksAlongZWithXToTheLeft) {
  const Transform t = Transform::LookAt({0, 0, 5}, {0, 0, 0}, {0, 1, 0});
  ExpectNear(t.Point({0, 0, 0}), {0, 0, 5});
  ExpectNear(t.Vector({0, 0, 1}), {0, 0, -1});
  ExpectNear(t.Vector({0, 1, 0}), {0, 1, 0});
  ExpectNear(t.Vector({1, 0, 0}), {-1, 0, 0});
  EXPECT_NEAR(t.Determinant(), 1, 1e-6);
}

TEST(TransformTest, NormalsStayPerpendicularAndOutward) {
  // The plane x + y = const, squeezed along x.
  const Transform squeeze = Transform::Scale(0.5, 1, 1);
  ExpectNear(squeeze.Normal({1, 1, 0}), Normalized(Vec3{2, 1, 0}));
  const Transform mirror = Transform::Scale(-1, 1, 1);
  ExpectNear(mirror.Normal({1, 0, 0}), {-1, 0, 0});
  ExpectNear(mirror.Normal({0, 1, 0}), {0, 1, 0});
}

TEST(TransformTest, RefusesViewsWithoutAFrame) {
  EXPECT_THROW(Transform::LookAt({1, 1, 1}, {1, 1, 1}, {0, 1, 0}), Error);
  EXPECT_THROW(Transform::LookAt({0, 0, 0}, {0, 3, 0}, {0, 1, 0}), Error);
  EXPECT_THROW(Transform::Rotate({0, 0, 0}, 10), Error);
}

}  // namespace
}  // namespace nacre::render
