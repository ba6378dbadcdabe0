#include "render/mesh.h"

#include "core/error.h"
#include "tests/support/error_message.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <numbers>

namespace nacre::render {
namespace {

using nacre::testing::ErrorMessage;
using ::testing::HasSubstr;

TEST(MeshTest, AreasOfTheBuiltInShapesAreTheTextbooks) {
  EXPECT_NEAR(SurfaceArea(MakeRectangle()), 4, 1e-6);
  EXPECT_NEAR(SurfaceArea(MakeCube()), 24, 1e-5);
  EXPECT_NEAR(SurfaceArea(MakeDisk()), std::numbers::pi, 3e-5);
}

TEST(MeshTest, FacesOfTheBuiltInShapesAreCounterClockwiseSeenFromOutside) {
  for (const TriangleMesh& mesh : {MakeRectangle(), MakeCube(), MakeDisk()}) {
    for (const auto& t : mesh.triangles) {
      const Vec3 face = Cross(mesh.positions[t[1]] - mesh.positions[t[0]],
                              mesh.positions[t[2]] - mesh.positions[t[0]]);
      EXPECT_GT(Dot(face, mesh.normals[t[0]]), 0);
    }
  }
}

TEST(MeshTest, SmoothNormalsOfACubeWithSharedCornersPointAlongTheDiagonals) {
  TriangleMesh cube;
  for (int i = 0; i < 8; ++i) {
    cube.positions.push_back({(i & 1) != 0 ? 1.0F : -1.0F,
                              (i & 2) != 0 ? 1.0F : -1.0F,
                              (i & 4) != 0 ? 1.0F : -1.0F});
  }
  cube.triangles = {{0, 2, 3},
                    {0, 3, 1},
                    {4, 5, 7},
                    {4, 7, 6},
                    {0, 1, 5},
                    {0, 5, 4},
                    {2, 6, 7},
                    {2, 7, 3},
                    {0, 4, 6},
                    {0, 6, 2},
                    {1, 3, 7},
                    {1, 7, 5}};
  ComputeNormals(cube);
  for (std::size_t i = 0; i < 8; ++i) {
    // Weighting by angle makes the diagonals of the faces irrelevant.
    EXPECT_NEAR(Dot(cube.normals[i], Normalized(cube.positions[i])), 1, 1e-6);
  }
}

TEST(MeshTest, DropsTrianglesWithoutAreaAndCountsThem) {
  TriangleMesh mesh = MakeRectangle();
  mesh.triangles.push_back({0, 0, 1});
  mesh.triangles.push_back({2, 2, 2});
  EXPECT_EQ(CheckMesh(mesh, "m").degenerate_triangles_dropped, 2);
  EXPECT_EQ(mesh.triangles.size(), 2u);
}

TEST(MeshTest, ReplacesNormalsOfLengthZero) {
  TriangleMesh mesh = MakeRectangle();
  mesh.normals[2] = {0, 0, 0};
  mesh.normals[1] = {0, 0, 7};
  CheckMesh(mesh, "m");
  EXPECT_EQ(mesh.normals[2], (Vec3{0, 0, 1}));
  EXPECT_EQ(mesh.normals[1], (Vec3{0, 0, 1}));
}

TEST(MeshTest, RejectsWhatIsNotAMesh) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  TriangleMesh bad_index = MakeRectangle();
  bad_index.triangles[1][2] = 4;
  EXPECT_THAT(ErrorMessage([&] { CheckMesh(bad_index, "a.obj"); }),
              HasSubstr("a.obj: a face uses vertex 4, but there are only 4"));
  TriangleMesh bad_position = MakeRectangle();
  bad_position.positions[3].y = nan;
  EXPECT_THAT(ErrorMessage([&] { CheckMesh(bad_position, "a.obj"); }),
              HasSubstr("position of vertex 3 isn't finite"));
  TriangleMesh bad_uv = MakeRectangle();
  bad_uv.uvs[0].x = std::numeric_limits<float>::infinity();
  EXPECT_THAT(ErrorMessage([&] { CheckMesh(bad_uv, "a.obj"); }),
              HasSubstr("texture coordinate of vertex 0"));
  TriangleMesh bad_normal = MakeRectangle();
  bad_normal.normals[1].z = nan;
  EXPECT_THAT(ErrorMessage([&] { CheckMesh(bad_normal, "a.obj"); }),
              HasSubstr("normal of vertex 1"));
  TriangleMesh bad_count = MakeRectangle();
  bad_count.uvs.pop_back();
  EXPECT_THAT(ErrorMessage([&] { CheckMesh(bad_count, "a.obj"); }),
              HasSubstr("3 texture coordinates for 4 vertices"));
  TriangleMesh empty;
  EXPECT_THAT(ErrorMessage([&] { CheckMesh(empty, "a.obj"); }),
              HasSubstr("no triangle"));
}

}  // namespace
}  // namespace nacre::render
