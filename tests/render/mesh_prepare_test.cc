// OFF, gzip, written PLY, and scans made ready for a material.
#include "render/mesh_prepare.h"

#include "core/atomic_file.h"
#include "core/error.h"
#include "render/gzip.h"
#include "render/mesh_file.h"
#include "render/off.h"
#include "tests/support/error_message.h"
#include "tests/support/temp_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <zlib.h>

namespace nacre::render {
namespace {

using nacre::testing::ErrorMessage;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

std::string OffError(const std::string& text) {
  return ErrorMessage([&] { ParseOff(text, "m.off"); });
}

std::string Gzip(const std::string& text) {
  z_stream stream{};
  EXPECT_EQ(deflateInit2(&stream, 6, Z_DEFLATED, MAX_WBITS + 16, 8, Z_DEFAULT_STRATEGY),
            Z_OK);
  std::string in = text;
  std::string out(text.size() + 1000, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(in.data());
  stream.avail_in = static_cast<uInt>(in.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
  const std::size_t length = stream.total_out;
  deflateEnd(&stream);
  return out.substr(0, length);
}

const std::string kQuad =
    "OFF # a comment\n\n4 1 0\n0 0 0\n2 0 0\n2 1 0\n0 1 0\n4 0 1 2 3 255 0 0\n";

TEST(OffTest, ReadsPolygonsAndSkipsColours) {
  const TriangleMesh mesh = ParseOff(kQuad, "m.off");
  EXPECT_EQ(mesh.positions.size(), 4u);
  ASSERT_EQ(mesh.triangles.size(), 2u);
  EXPECT_EQ(mesh.triangles[1], (std::array<std::uint32_t, 3>{0, 2, 3}));
  EXPECT_EQ(mesh.positions[2], (Vec3{2, 1, 0}));
}

TEST(OffTest, BadFilesAreRefusedWithTheLine) {
  EXPECT_THAT(OffError("PLY\n"), HasSubstr("m.off:1: this isn't an OFF file"));
  EXPECT_THAT(OffError("OFF\n"), HasSubstr("ends here"));
  EXPECT_THAT(OffError("OFF\n3 1 0\n0 0 0\n1 0 0\n"), HasSubstr("don't fit into 22"));
  EXPECT_THAT(OffError("OFF\n3 1 0\n0 0 0\n1 x 0\n0 1 0\n3 0 1 2\n"),
              HasSubstr("m.off:4: 'x' where a coordinate"));
  EXPECT_THAT(OffError("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n"),
              HasSubstr("m.off:6: vertex 3 of 3"));
  EXPECT_THAT(OffError("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n2 0 1\n"),
              HasSubstr("a face of 2 corners"));
  EXPECT_THAT(OffError("OFF\n4000000000 1 0\n0 0 0\n"), HasSubstr("don't fit into"));
  EXPECT_THAT(OffError("OFF\n3 1 0\n0 0 0\n1 nan 0\n0 1 0\n3 0 1 2\n"),
              HasSubstr("isn't finite"));
}

TEST(GunzipTest, UnpacksAndConcatenates) {
  const std::string text(300000, 'n');
  EXPECT_EQ(Gunzip(Gzip(text), "a.gz"), text);
  EXPECT_EQ(Gunzip(Gzip("one ") + Gzip("two"), "a.gz"), "one two");
}

TEST(GunzipTest, DamageAndBombsAreRefused) {
  const std::string whole = Gzip(kQuad);
  for (const std::size_t size : {std::size_t{0}, std::size_t{5}, whole.size() - 1}) {
    EXPECT_THAT(ErrorMessage([&] { Gunzip(whole.substr(0, size), "a.gz"); }),
                HasSubstr("a.gz: damaged or cut short"))
        << size;
  }
  std::string changed = whole;
  changed[whole.size() - 6] = static_cast<char>(changed[whole.size() - 6] ^ 1);
  EXPECT_THAT(ErrorMessage([&] { Gunzip(changed, "a.gz"); }), HasSubstr("damaged"));
  EXPECT_THAT(ErrorMessage([&] { Gunzip(Gzip(std::string(9999, 'n')), "a.gz", 1000); }),
              HasSubstr("more than 1000 bytes"));
}

TEST(MeshFileTest, WrittenPlyReadsBackTheSame) {
  const nacre::testing::TempFolder folder;
  TriangleMesh mesh = MakeRectangle();
  WritePly(folder / "m.ply", mesh, R"({"command":"mesh"})");
  const TriangleMesh again = ReadMeshFile(folder / "m.ply");
  EXPECT_EQ(again.triangles, mesh.triangles);
  ASSERT_EQ(again.positions.size(), mesh.positions.size());
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    EXPECT_EQ(again.positions[i], mesh.positions[i]);
    EXPECT_EQ(again.uvs[i].x, mesh.uvs[i].x);
    EXPECT_EQ(again.uvs[i].y, mesh.uvs[i].y);
  }
  EXPECT_THAT(ReadFile(folder / "m.ply"), HasSubstr(R"({"command":"mesh"})"));
}

TEST(MeshFileTest, PackedFilesAreUnpackedAndOthersRefused) {
  const nacre::testing::TempFolder folder;
  WriteFile(folder / "m.off.gz", Gzip(kQuad));
  EXPECT_EQ(ReadMeshFile(folder / "m.off.gz").triangles.size(), 2u);
  EXPECT_THAT([&] { ReadMeshFile(folder / "m.stl"); },
              ThrowsMessage<Error>(HasSubstr("a mesh is a .ply, .obj or .off")));
}

/// A cube whose sides don't share vertices, as many programs write them.
TriangleMesh LooseCube(Vec3 offset) {
  TriangleMesh mesh = MakeCube();
  TriangleMesh loose;
  for (const auto& triangle : mesh.triangles) {
    const auto first = static_cast<std::uint32_t>(loose.positions.size());
    for (const std::uint32_t index : triangle) {
      loose.positions.push_back(mesh.positions[index] + offset);
    }
    loose.triangles.push_back({first, first + 1, first + 2});
  }
  return loose;
}

TEST(PrepareMeshTest, StandsCentredAtItsWidth) {
  TriangleMesh mesh = LooseCube({5, -7, 3});
  const MeshPrepareSummary summary = PrepareMesh(mesh, {.width_mm = 30, .highest = 5});
  Vec3 low{1e9F, 1e9F, 1e9F};
  Vec3 high = -low;
  for (const Vec3 p : mesh.positions) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  EXPECT_NEAR(low.x, -15, 1e-4);
  EXPECT_NEAR(high.x, 15, 1e-4);
  EXPECT_NEAR(low.y, 0, 1e-4);
  EXPECT_NEAR(high.y, 30, 1e-4);
  EXPECT_NEAR(low.z, -15, 1e-4);
  EXPECT_NEAR(summary.area_mm2, 6 * 900, 0.1);
  EXPECT_EQ(summary.components, 1);  // once its vertices are welded
  EXPECT_EQ(summary.triangles, 12);
}

TEST(PrepareMeshTest, TextureHasTheScaleOfTheObjectAndIsNeverMirrored) {
  TriangleMesh mesh = LooseCube({0, 0, 0});
  PrepareMesh(mesh, {.width_mm = 30, .highest = 5});
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& t = mesh.triangles[i];
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k];
      const std::uint32_t b = t[(k + 1) % 3];
      const float along =
          std::hypot(mesh.uvs[b].x - mesh.uvs[a].x, mesh.uvs[b].y - mesh.uvs[a].y);
      EXPECT_NEAR(30 * along, Length(mesh.positions[b] - mesh.positions[a]), 1e-3);
    }
    // Counter-clockwise outside is counter-clockwise in the picture.
    const Vec2 p = mesh.uvs[t[0]];
    const Vec2 q = mesh.uvs[t[1]];
    const Vec2 r = mesh.uvs[t[2]];
    EXPECT_GT((q.x - p.x) * (r.y - p.y) - (q.y - p.y) * (r.x - p.x), 0) << i;
  }
}

TEST(PrepareMeshTest, OtherAxesCanPointUp) {
  for (const char* up : {"x", "z"}) {
    TriangleMesh mesh = MakeCube();
    for (Vec3& p : mesh.positions) {
      p = *up == 'z' ? p * Vec3{1, 1, 3} : p * Vec3{3, 1, 1};
    }
    mesh.normals.clear();
    const MeshPrepareSummary summary =
        PrepareMesh(mesh, {.width_mm = 10, .highest = 5, .up = up});
    EXPECT_NEAR(summary.size_mm.y, 30, 1e-3) << up;
    for (const auto& t : mesh.triangles) {
      const Vec3 face = Cross(mesh.positions[t[1]] - mesh.positions[t[0]],
                              mesh.positions[t[2]] - mesh.positions[t[0]]);
      EXPECT_GT(Dot(face, mesh.positions[t[0]] - Vec3{0, 15, 0}), 0) << "inside out";
    }
  }
}

TEST(PrepareMeshTest, TurnsAndShrinksWhatWouldNotFit) {
  TriangleMesh mesh = MakeCube();
  for (Vec3& p : mesh.positions) {
    p = p * Vec3{1, 4, 2};
  }
  const MeshPrepareSummary summary = PrepareMesh(mesh, {.width_mm = 100});
  EXPECT_NEAR(summary.size_mm.x, 37.5, 1e-3);  // was z: twice as wide as deep
  EXPECT_NEAR(summary.size_mm.y, 75, 1e-3);
  EXPECT_NEAR(summary.size_mm.z, 18.75, 1e-3);
  for (const auto& t : mesh.triangles) {
    const Vec3 face = Cross(mesh.positions[t[1]] - mesh.positions[t[0]],
                            mesh.positions[t[2]] - mesh.positions[t[0]]);
    EXPECT_GT(Dot(face, mesh.positions[t[0]] - Vec3{0, 37.5F, 0}), 0) << "inside out";
  }
}

TEST(PrepareMeshTest, OnlyTheLargestPartIfAskedFor) {
  TriangleMesh mesh = LooseCube({0, 0, 0});
  mesh.positions.insert(mesh.positions.end(), {{9, 0, 0}, {9.1F, 0, 0}, {9, 0.1F, 0}});
  const auto first = static_cast<std::uint32_t>(mesh.positions.size() - 3);
  mesh.triangles.push_back({first, first + 1, first + 2});
  TriangleMesh all = mesh;
  EXPECT_EQ(PrepareMesh(all, {}).components, 2);
  EXPECT_EQ(all.triangles.size(), 13u);
  const MeshPrepareSummary summary =
      PrepareMesh(mesh, {.highest = 1, .largest_component = true});
  EXPECT_EQ(summary.components_dropped, 1);
  EXPECT_EQ(mesh.triangles.size(), 12u);
  EXPECT_NEAR(summary.size_mm.y, 126, 1e-2);  // the dropped part doesn't count
}

TEST(PrepareMeshTest, RefusesWhatHasNoWidthAndBadOptions) {
  TriangleMesh flat;
  flat.positions = {{0, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const MeshPrepareOptions unturned{.widest_across = false};
  flat.triangles = {{0, 1, 2}};
  EXPECT_THAT(ErrorMessage([&] { PrepareMesh(flat, unturned); }),
              HasSubstr("no width in x"));
  TriangleMesh cube = MakeCube();
  EXPECT_THAT([&] { PrepareMesh(cube, {.up = "w"}); },
              ThrowsMessage<Error>(HasSubstr("'w' isn't one of x, y and z")));
  EXPECT_THAT([&] { PrepareMesh(cube, {.width_mm = -1}); },
              ThrowsMessage<Error>(HasSubstr("width_mm")));
}

}  // namespace
}  // namespace nacre::render
