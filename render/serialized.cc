#include "render/serialized.h"

#include "core/atomic_file.h"
#include "core/error.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <fmt/format.h>
#include <limits>
#include <memory>
#include <vector>
#include <zlib.h>

namespace nacre::render {
namespace {

static_assert(std::endian::native == std::endian::little, "the format's byte order");

constexpr std::uint16_t kMeshMagic = 0x041C;
constexpr std::size_t kMeshHeaderBytes = 4;  // magic and version

enum Flags : std::uint32_t {
  kNormals = 0x0001,
  kUvs = 0x0002,
  kColors = 0x0008,
  kFaceNormals = 0x0010,
  kSinglePrecision = 0x1000,
  kDoublePrecision = 0x2000,
};

template <class T>
T At(std::string_view bytes, std::size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof(T));
  return value;
}

/// Numbers out of a zlib stream, one after the other.
class Stream {
 public:
  Stream(std::string_view bytes, const std::string& origin) : origin_(origin) {
    if (inflateInit(&stream_) != Z_OK) {
      throw Error(origin + ": zlib can't be started: not enough memory?");
    }
    // zlib's interface takes no const, but doesn't write to its input.
    stream_.next_in =
        reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));  // NOLINT
    stream_.avail_in = static_cast<uInt>(
        std::min<std::size_t>(bytes.size(), std::numeric_limits<uInt>::max()));
    most_ = bytes.size() * kMostRatio;
  }
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;
  ~Stream() { inflateEnd(&stream_); }

  template <class T>
  T Next() {
    T value;
    Read(&value, sizeof(T));
    return value;
  }

  template <class T>
  std::vector<T> Next(std::uint64_t count) {
    CheckCount(count, sizeof(T));
    std::vector<T> values(count);
    Read(values.data(), values.size() * sizeof(T));
    return values;
  }

  void SkipString() {
    while (Next<char>() != 0) {
    }
  }

  /// What zlib packs is at most 1032 times smaller: more can't be in the file.
  void CheckCount(std::uint64_t count, std::size_t size) const {
    if (count > most_ / size) {
      Fail(fmt::format("{} values announced, more than the file can hold", count));
    }
  }

  [[noreturn]] void Fail(const std::string& message) const {
    throw BadData(fmt::format("{}: {}", origin_, message));
  }

 private:
  static constexpr std::uint64_t kMostRatio = 1032;

  void Read(void* to, std::size_t size) {
    auto* next = static_cast<Bytef*>(to);
    while (size > 0) {
      const std::size_t step =
          std::min<std::size_t>(size, std::numeric_limits<uInt>::max());
      stream_.next_out = next;
      stream_.avail_out = static_cast<uInt>(step);
      const int status = inflate(&stream_, Z_SYNC_FLUSH);
      const std::size_t got = step - stream_.avail_out;
      next += got;
      size -= got;
      if ((status != Z_OK && status != Z_STREAM_END) ||
          (size > 0 && (got == 0 || status == Z_STREAM_END))) {
        Fail(fmt::format("damaged or cut short after {} unpacked bytes ({})",
                         stream_.total_out,
                         stream_.msg != nullptr ? stream_.msg : "end of data"));
      }
    }
  }

  const std::string& origin_;
  z_stream stream_{};
  std::uint64_t most_ = 0;
};

// The bytes of one mesh, header included.
std::string_view FindMesh(std::string_view bytes,
                          const std::string& origin,
                          int shape_index) {
  const auto fail = [&](const std::string& message) {
    throw BadData(fmt::format("{}: {}", origin, message));
  };
  if (bytes.size() < kMeshHeaderBytes + 4 ||
      At<std::uint16_t>(bytes, 0) != kMeshMagic) {
    fail("not a .serialized mesh");
  }
  const auto version = At<std::uint16_t>(bytes, 2);
  if (version != 3 && version != 4) {
    fail(fmt::format("version {} of the format; 3 and 4 can be read", version));
  }
  const std::uint64_t count = At<std::uint32_t>(bytes, bytes.size() - 4);
  const std::uint64_t entry = version == 4 ? 8 : 4;
  if (count == 0 || count * entry > bytes.size() - 4 - kMeshHeaderBytes) {
    fail(fmt::format("cut short: its dictionary names {} meshes", count));
  }
  if (shape_index < 0 || static_cast<std::uint64_t>(shape_index) >= count) {
    fail(fmt::format("no mesh {} in it: there are {}, from 0 on", shape_index, count));
  }
  const std::uint64_t dictionary = bytes.size() - 4 - count * entry;
  const auto offset = [&](std::uint64_t index) -> std::uint64_t {
    const std::uint64_t at = dictionary + index * entry;
    return version == 4 ? At<std::uint64_t>(bytes, at) : At<std::uint32_t>(bytes, at);
  };
  const auto index = static_cast<std::uint64_t>(shape_index);
  const std::uint64_t begin = offset(index);
  const std::uint64_t end = index + 1 < count ? offset(index + 1) : dictionary;
  if (begin > dictionary || end > dictionary || end < begin + kMeshHeaderBytes) {
    fail(fmt::format(
        "mesh {} lies from byte {} to {} of {}", index, begin, end, bytes.size()));
  }
  const auto mesh = bytes.substr(begin, end - begin);
  if (At<std::uint16_t>(mesh, 0) != kMeshMagic ||
      At<std::uint16_t>(mesh, 2) != version) {
    fail(fmt::format("no mesh at byte {}, where the dictionary has one", begin));
  }
  return mesh;
}

template <class Real, class Vector>
std::vector<Vector> Vectors(Stream& stream, std::uint64_t count) {
  constexpr std::uint64_t kSize = sizeof(Vector) / sizeof(float);
  stream.CheckCount(count, kSize * sizeof(Real));
  const std::vector<Real> values = stream.Next<Real>(count * kSize);
  std::vector<Vector> vectors(count);
  for (std::size_t i = 0; i < vectors.size(); ++i) {
    const Real* v = &values[i * kSize];
    vectors[i].x = static_cast<float>(v[0]);
    vectors[i].y = static_cast<float>(v[1]);
    if constexpr (kSize == 3) {
      vectors[i].z = static_cast<float>(v[2]);
    }
  }
  return vectors;
}

template <class Real>
void ReadVertices(Stream& stream,
                  std::uint32_t flags,
                  std::uint64_t count,
                  TriangleMesh& mesh) {
  mesh.positions = Vectors<Real, Vec3>(stream, count);
  if ((flags & kNormals) != 0) {
    mesh.normals = Vectors<Real, Vec3>(stream, count);
  }
  if ((flags & kUvs) != 0) {
    mesh.uvs = Vectors<Real, Vec2>(stream, count);
  }
  if ((flags & kColors) != 0) {
    Vectors<Real, Vec3>(stream, count);
  }
}

}  // namespace

SerializedMesh ParseSerialized(std::string_view bytes,
                               const std::string& origin,
                               int shape_index) {
  const std::string_view found = FindMesh(bytes, origin, shape_index);
  Stream stream(found.substr(kMeshHeaderBytes), origin);
  const auto flags = stream.Next<std::uint32_t>();
  if (At<std::uint16_t>(found, 2) == 4) {
    stream.SkipString();  // its name
  }
  const auto vertex_count = stream.Next<std::uint64_t>();
  const auto triangle_count = stream.Next<std::uint64_t>();
  if (vertex_count > std::numeric_limits<std::uint32_t>::max()) {
    stream.Fail(fmt::format("{} vertices; 2^32 are too many", vertex_count));
  }
  SerializedMesh result;
  result.face_normals = (flags & kFaceNormals) != 0;
  TriangleMesh& mesh = result.mesh;
  if ((flags & kDoublePrecision) != 0) {
    ReadVertices<double>(stream, flags, vertex_count, mesh);
  } else if ((flags & kSinglePrecision) != 0) {
    ReadVertices<float>(stream, flags, vertex_count, mesh);
  } else {
    stream.Fail(
        fmt::format("flags {:#x} name neither single nor double precision", flags));
  }
  mesh.triangles = stream.Next<std::array<std::uint32_t, 3>>(triangle_count);
  return result;
}

SerializedMesh ReadSerialized(const std::filesystem::path& path, int shape_index) {
  return ParseSerialized(ReadFile(path), path.string(), shape_index);
}

}  // namespace nacre::render
