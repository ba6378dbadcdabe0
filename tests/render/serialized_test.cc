// Mitsuba's .serialized meshes, written here byte by byte as the format says.
#include "render/serialized.h"

#include "core/atomic_file.h"
#include "tests/render/scene_text.h"
#include "tests/support/error_message.h"
#include "tests/support/temp_folder.h"

#include <gmock/gmock.h>

#include <cstring>
#include <zlib.h>

namespace nacre::render::testing {
namespace {

using nacre::testing::ErrorMessage;
using ::testing::HasSubstr;

template <class T>
void Add(std::string& bytes, const T& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(T));  // NOLINT
}

std::string Deflated(const std::string& bytes) {
  uLongf size = compressBound(bytes.size());
  std::string packed(size, '\0');
  EXPECT_EQ(compress(reinterpret_cast<Bytef*>(packed.data()),  // NOLINT
                     &size,
                     reinterpret_cast<const Bytef*>(bytes.data()),  // NOLINT
                     bytes.size()),
            Z_OK);
  packed.resize(size);
  return packed;
}

// The square of two triangles, at height z.
template <class Real>
std::string Body(std::uint32_t flags, bool named, Real z) {
  std::string body;
  Add(body, flags);
  if (named) {
    body.append("square\0", 7);
  }
  Add(body, std::uint64_t{4});
  Add(body, std::uint64_t{2});
  const auto add = [&](std::initializer_list<double> values) {
    for (const double v : values) {
      Add(body, static_cast<Real>(v));
    }
  };
  const auto height = static_cast<double>(z);
  add({0, 0, height, 1, 0, height, 1, 1, height, 0, 1, height});
  if ((flags & 0x1u) != 0) {
    add({0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1});
  }
  if ((flags & 0x2u) != 0) {
    add({0, 0, 1, 0, 1, 1, 0, 1});
  }
  if ((flags & 0x8u) != 0) {
    add({9, 9, 9, 9, 9, 9, 9, 9, 9, 9, 9, 9});
  }
  for (const std::uint32_t index : {0u, 1u, 2u, 0u, 2u, 3u}) {
    Add(body, index);
  }
  return body;
}

std::string File(std::uint16_t version, const std::vector<std::string>& bodies) {
  std::string bytes;
  std::vector<std::uint64_t> offsets;
  for (const std::string& body : bodies) {
    offsets.push_back(bytes.size());
    Add(bytes, std::uint16_t{0x041C});
    Add(bytes, version);
    bytes += Deflated(body);
  }
  for (const std::uint64_t offset : offsets) {
    version == 4 ? Add(bytes, offset) : Add(bytes, static_cast<std::uint32_t>(offset));
  }
  Add(bytes, static_cast<std::uint32_t>(bodies.size()));
  return bytes;
}

std::string TwoMeshes() {
  return File(4, {Body<float>(0x1003, true, 5), Body<double>(0x201B, true, 7)});
}

TEST(SerializedTest, ReadsBothPrecisionsAndTheMeshAskedFor) {
  const SerializedMesh first = ParseSerialized(TwoMeshes(), "m", 0);
  EXPECT_FALSE(first.face_normals);
  ASSERT_EQ(first.mesh.positions.size(), 4u);
  EXPECT_EQ(first.mesh.positions[2], (Vec3{1, 1, 5}));
  EXPECT_EQ(first.mesh.normals[3], (Vec3{0, 0, 1}));
  EXPECT_EQ(first.mesh.uvs[1].x, 1);
  EXPECT_EQ(first.mesh.triangles[1], (std::array<std::uint32_t, 3>{0, 2, 3}));
  const SerializedMesh second = ParseSerialized(TwoMeshes(), "m", 1);
  EXPECT_TRUE(second.face_normals);
  EXPECT_EQ(second.mesh.positions[2], (Vec3{1, 1, 7}));
  EXPECT_EQ(second.mesh.triangles, first.mesh.triangles);
  const auto old = ParseSerialized(File(3, {Body<float>(0x1000, false, 2)}), "m", 0);
  EXPECT_EQ(old.mesh.positions[1], (Vec3{1, 0, 2}));
  EXPECT_TRUE(old.mesh.normals.empty());
}

TEST(SerializedTest, WhatIsCutShortOrDamagedIsAnError) {
  const std::string whole = TwoMeshes();
  for (std::size_t size = 0; size < whole.size(); ++size) {
    EXPECT_NE(ErrorMessage([&] { ParseSerialized(whole.substr(0, size), "m", 1); }), "")
        << size;
  }
  // A byte more or less anywhere is an error or another mesh, never a crash.
  for (std::size_t at = 0; at < whole.size(); ++at) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x55);
    try {
      ParseSerialized(damaged, "m", 1);
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ExitCode::kBadData) << e.what();
    }
  }
}

TEST(SerializedTest, ErrorsSayWhatWasFound) {
  const auto error = [](const std::string& bytes, int index) {
    return ErrorMessage([&] { ParseSerialized(bytes, "m.serialized", index); });
  };
  EXPECT_THAT(error("ply\nformat", 0), HasSubstr("not a .serialized mesh"));
  EXPECT_THAT(error(File(5, {Body<float>(0x1000, true, 1)}), 0),
              HasSubstr("version 5"));
  EXPECT_THAT(error(TwoMeshes(), 2), HasSubstr("no mesh 2 in it: there are 2"));
  EXPECT_THAT(error(File(4, {Body<float>(0x0003, true, 1)}), 0), HasSubstr("neither"));
  std::string huge = Body<float>(0x1000, true, 1);
  const std::uint64_t count = 4'000'000'000;
  std::memcpy(&huge[11], &count, sizeof(count));
  EXPECT_THAT(error(File(4, {huge}), 0), HasSubstr("more than the file can hold"));
}

TEST(SerializedTest, IsAShapeOfAScene) {
  const nacre::testing::TempFolder folder;
  const auto path = folder.path() / "two.serialized";
  WriteFile(path, TwoMeshes());
  const auto shape = [&](const std::string& rest) {
    return SceneText("<shape type=\"serialized\"><string name=\"filename\" value=\"" +
                     path.string() + "\"/>" + rest +
                     "</shape><emitter type=\"constant\"/>");
  };
  const Scene scene = Parse(shape("<integer name=\"shapeIndex\" value=\"1\"/>"));
  const auto& mesh = std::get<TriangleMesh>(scene.shapes.at(0).geometry);
  EXPECT_EQ(mesh.positions[0], (Vec3{0, 0, 7}));
  EXPECT_TRUE(mesh.normals.empty());
  EXPECT_FALSE(
      std::get<TriangleMesh>(Parse(shape("")).shapes.at(0).geometry).normals.empty());
  EXPECT_THAT(ReaderError(shape("<integer name=\"shapeindex\" value=\"1\"/>")),
              HasSubstr("did you mean 'shapeIndex'?"));
}

}  // namespace
}  // namespace nacre::render::testing
