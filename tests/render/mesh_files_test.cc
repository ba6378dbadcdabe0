// OBJ and PLY: what is read, and what is refused.
#include "core/error.h"
#include "render/obj.h"
#include "render/ply.h"
#include "tests/support/error_message.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <functional>

namespace nacre::render {
namespace {

using nacre::testing::ErrorMessage;
using ::testing::HasSubstr;

std::string ObjError(const std::string& text) {
  return ErrorMessage([&] { ParseObj(text, "m.obj"); });
}

std::string PlyError(const std::string& bytes) {
  return ErrorMessage([&] { ParsePly(bytes, "m.ply"); });
}

TEST(ObjTest, ReadsPolygonsWithAllAttributesAndSharesVertices) {
  const TriangleMesh mesh = ParseObj(
      "# a quad\nmtllib x.mtl\n"
      "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\r\n"
      "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 1\n"
      "usemtl a\nf 1/1/1 2/2/1 3/3/1 4/4/1 # the only one\n",
      "m.obj");
  EXPECT_EQ(mesh.positions.size(), 4u);
  ASSERT_EQ(mesh.triangles.size(), 2u);
  EXPECT_EQ(mesh.triangles[1], (std::array<std::uint32_t, 3>{0, 2, 3}));
  EXPECT_EQ(mesh.uvs[2].x, 1);
  EXPECT_EQ(mesh.uvs[3].y, 1);
  EXPECT_EQ(mesh.normals[0], (Vec3{0, 0, 1}));
}

TEST(ObjTest, NegativeIndicesCountBackwards) {
  const TriangleMesh mesh =
      ParseObj("v 9 9 9\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\n", "m.obj");
  ASSERT_EQ(mesh.positions.size(), 3u);
  EXPECT_EQ(mesh.positions[0], (Vec3{0, 0, 0}));
  EXPECT_EQ(mesh.positions[2], (Vec3{0, 1, 0}));
}

TEST(ObjTest, ASeamSplitsAVertexAndMissingAttributesAreDropped) {
  const TriangleMesh mesh = ParseObj(
      "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 1\nvn 0 0 1\n"
      "f 1/1 2/1 3/1\nf 1/2 3/2 4/2\n",
      "m.obj");
  EXPECT_EQ(mesh.positions.size(), 6u);
  EXPECT_EQ(mesh.uvs.size(), 6u);
  EXPECT_TRUE(mesh.normals.empty());
  EXPECT_TRUE(ParseObj("v 0 0 0\nv 1 0 0\nv 1 1 0\nvn 0 0 1\nf 1//1 2//1 3//1\n", "m")
                  .uvs.empty());
}

TEST(ObjTest, ReadsAcrossLinesOfAnyEnding) {
  EXPECT_EQ(
      ParseObj("v 0 0 0\nv 1e0 -0 +0\nv 1 1 1e-60\nf 1 2 3", "m").triangles.size(), 1u);
}

TEST(ObjTest, SaysWhereItIsWrong) {
  EXPECT_THAT(ObjError("v 0 0 0\nv 1 x 0\n"), HasSubstr("m.obj:2: 'x' isn't a number"));
  EXPECT_THAT(ObjError("v 0 0\n"), HasSubstr("m.obj:1: a number is missing"));
  EXPECT_THAT(ObjError("v 0 0 0\nf 1 2 3\n"), HasSubstr("m.obj:2: vertex 2 of 1"));
  EXPECT_THAT(ObjError("v 0 0 0\nf 0 1 1\n"), HasSubstr("m.obj:2: vertex 0 of 1"));
  EXPECT_THAT(ObjError("v 0 0 0\nf -2 1 1\n"), HasSubstr("vertex -2 of 1"));
  EXPECT_THAT(ObjError("v 0 0 0\nf 1 1\n"), HasSubstr("a face with 2 corners"));
  EXPECT_THAT(ObjError("v 0 0 0\nf 1/1 1/1 1/1\n"),
              HasSubstr("texture coordinate 1 of 0"));
  EXPECT_THAT(ObjError("v 0 0 0\nf 1//3 1 1\n"), HasSubstr("normal 3 of 0"));
  EXPECT_THAT(ObjError("v 0 0 0\nf 1/1/1/1 1 1\nvt 0 0\n"), HasSubstr("m.obj:2"));
  EXPECT_THAT(ObjError("v 0 0 0\nf a b c\n"), HasSubstr("'a' isn't an index"));
  EXPECT_THAT(ObjError("hello\n"), HasSubstr("no face"));
}

TEST(ObjTest, EveryCutOffFileGivesAMeshOrAnError) {
  const std::string whole =
      "v 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1\n";
  int errors = 0;
  for (std::size_t size = 0; size < whole.size(); ++size) {
    errors += ObjError(whole.substr(0, size)) == "no error" ? 0 : 1;
  }
  EXPECT_GT(errors, 40);
}

// A quad and a triangle beside it with an extra element and property in the way.
constexpr const char* kHeader =
    "comment made by hand\nelement vertex 4\nproperty float x\nproperty double y\n"
    "property float z\nproperty uchar quality\nproperty float s\nproperty float t\n"
    "element extra 1\nproperty list uchar short numbers\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n";

void Append(std::string& bytes, const void* value, std::size_t size, bool big_endian) {
  std::string raw(size, '\0');
  std::memcpy(raw.data(), value, size);
  if (big_endian) {
    std::reverse(raw.begin(), raw.end());
  }
  bytes += raw;
}

std::string BinaryQuad(bool big_endian) {
  std::string bytes = std::string("ply\nformat binary_") +
                      (big_endian ? "big" : "little") + "_endian 1.0\n" + kHeader;
  const float corners[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  for (const auto& corner : corners) {
    const double y = static_cast<double>(corner[1]);
    const float z = 7;
    const std::uint8_t quality = 200;
    Append(bytes, &corner[0], 4, big_endian);
    Append(bytes, &y, 8, big_endian);
    Append(bytes, &z, 4, big_endian);
    Append(bytes, &quality, 1, big_endian);
    Append(bytes, &corner[0], 4, big_endian);
    Append(bytes, &corner[1], 4, big_endian);
  }
  const std::uint8_t two = 2;
  const std::int16_t number = -5;
  Append(bytes, &two, 1, big_endian);
  Append(bytes, &number, 2, big_endian);
  Append(bytes, &number, 2, big_endian);
  const std::uint8_t four = 4;
  Append(bytes, &four, 1, big_endian);
  for (std::int32_t i = 0; i < 4; ++i) {
    Append(bytes, &i, 4, big_endian);
  }
  return bytes;
}

std::string AsciiQuad() {
  return std::string("ply\nformat ascii 1.0\n") + kHeader +
         "0 0 7 200 0 0\n1 0 7 200 1 0\n1 1 7 200 1 1\n0 1 7 200 0 1\n2 -5 -5\n"
         "4 0 1 2 3\n";
}

TEST(PlyTest, ReadsAllThreeEncodingsAlike) {
  for (const std::string& bytes : {AsciiQuad(), BinaryQuad(false), BinaryQuad(true)}) {
    const TriangleMesh mesh = ParsePly(bytes, "m.ply");
    ASSERT_EQ(mesh.positions.size(), 4u);
    EXPECT_EQ(mesh.positions[2], (Vec3{1, 1, 7}));
    ASSERT_EQ(mesh.uvs.size(), 4u);
    EXPECT_EQ(mesh.uvs[1].x, 1);
    EXPECT_EQ(mesh.uvs[1].y, 0);
    EXPECT_TRUE(mesh.normals.empty());
    ASSERT_EQ(mesh.triangles.size(), 2u);
    EXPECT_EQ(mesh.triangles[1], (std::array<std::uint32_t, 3>{0, 2, 3}));
  }
}

TEST(PlyTest, EveryCutOffFileIsRefused) {
  for (const std::string& whole : {AsciiQuad(), BinaryQuad(false), BinaryQuad(true)}) {
    // The last newline and, in text, the last digit may go unnoticed.
    for (std::size_t size = 0; size + 2 < whole.size(); ++size) {
      EXPECT_NE(PlyError(whole.substr(0, size)), "no error") << size;
    }
  }
}

TEST(PlyTest, SaysWhereItIsWrong) {
  const auto replaced = [](const std::string& from, const std::string& to) {
    std::string text = AsciiQuad();
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos);
    return PlyError(text.replace(at, from.size(), to));
  };
  EXPECT_THAT(PlyError("solid x\n"), HasSubstr("m.ply:1: not a PLY file"));
  EXPECT_THAT(replaced("ascii", "utf8"), HasSubstr("m.ply:2: no format 'utf8'"));
  EXPECT_THAT(replaced("uchar quality", "octet quality"),
              HasSubstr("m.ply:8: no type 'octet'"));
  EXPECT_THAT(replaced("element vertex 4", "element vertex four"),
              HasSubstr("m.ply:4: 'four' isn't a count"));
  EXPECT_THAT(replaced("element vertex 4", "element vertex 4000000000000"),
              HasSubstr("cut off: 4000000000000 elements 'vertex'"));
  EXPECT_THAT(replaced("float z", "float w"), HasSubstr("without x, y and z"));
  EXPECT_THAT(replaced("vertex_indices", "edges"), HasSubstr("vertex_indices"));
  EXPECT_THAT(replaced("4 0 1 2 3", "4 0 1 2 4"),
              HasSubstr("face 0 uses vertex 4 of 4"));
  EXPECT_THAT(replaced("1 1 7", "1 oops 7"),
              HasSubstr("m.ply:18: 'oops' isn't a number"));
  EXPECT_THAT(replaced("2 -5 -5", "-2 -5 -5"), HasSubstr("negative count"));
}

TEST(PlyTest, APlusSignIsNoError) {
  std::string text = AsciiQuad();
  text.replace(text.find("1 1 7"), 5, "+1 1 +7");
  EXPECT_EQ(ParsePly(text, "m.ply").positions[2], (Vec3{1, 1, 7}));
}

TEST(PlyTest, NotANumberIsFoundByTheMeshCheck) {
  std::string text = AsciiQuad();
  text.replace(text.find("1 1 7"), 5, "1 nan 7");
  TriangleMesh mesh = ParsePly(text, "m.ply");
  EXPECT_THAT(ErrorMessage([&] { CheckMesh(mesh, "m.ply"); }),
              HasSubstr("position of vertex 2 isn't finite"));
}

}  // namespace
}  // namespace nacre::render
