#include "render/ply.h"

#include "core/atomic_file.h"
#include "core/error.h"
#include "render/ply_header.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstring>
#include <fmt/format.h>
#include <limits>

namespace nacre::render {
namespace {

// The numbers of a PLY body one after the other, whatever the encoding.
class PlyNumbers {
 public:
  PlyNumbers(std::string_view bytes, const PlyHeader& header, const std::string& origin)
      : body_(bytes.substr(header.size)),
        encoding_(header.encoding),
        line_number_(header.line_count + 1),
        origin_(origin) {}

  double Next(PlyType type) {
    return encoding_ == PlyEncoding::kAscii ? NextAscii() : NextBinary(type);
  }

  /// An element of `size` bytes or, in text, as many numbers takes at least this much:
  /// a count that can't be true isn't allocated.
  void CheckCount(std::int64_t count, const PlyElement& element) const {
    std::size_t least = 0;
    for (const PlyProperty& property : element.properties) {
      const PlyType type = property.is_list ? property.count_type : property.type;
      least += encoding_ == PlyEncoding::kAscii ? 2 : SizeOf(type);
    }
    const std::size_t left = body_.size() - at_ + 1;
    if (least > 0 && static_cast<std::uint64_t>(count) > left / least) {
      throw BadData(
          fmt::format("{}: cut off: {} elements '{}' announced, {} bytes left",
                      origin_,
                      count,
                      element.name,
                      body_.size() - at_));
    }
  }

  [[noreturn]] void Fail(const std::string& message) const {
    if (encoding_ == PlyEncoding::kAscii) {
      throw BadData(fmt::format("{}:{}: {}", origin_, line_number_, message));
    }
    throw BadData(fmt::format("{}: {}", origin_, message));
  }

 private:
  double NextAscii() {
    while (at_ < body_.size() && IsSpace(body_[at_])) {
      line_number_ += body_[at_] == '\n' ? 1 : 0;
      ++at_;
    }
    const char* const end = body_.data() + body_.size();
    if (at_ + 1 < body_.size() && body_[at_] == '+' && body_[at_ + 1] != '-') {
      ++at_;  // from_chars takes no plus
    }
    const char* const begin = body_.data() + at_;
    if (begin == end) {
      Fail("cut off: a number is missing");
    }
    double value = 0;
    const auto [stop, failure] = std::from_chars(begin, end, value);
    if (failure == std::errc::invalid_argument || (stop != end && !IsSpace(*stop))) {
      Fail(fmt::format("'{}' isn't a number",
                       std::string(begin, std::find_if(begin, end, IsSpace))));
    }
    at_ += static_cast<std::size_t>(stop - begin);
    return value;
  }

  double NextBinary(PlyType type) {
    const std::size_t size = SizeOf(type);
    if (size > body_.size() - at_) {
      Fail(fmt::format("cut off after {} bytes of data", body_.size()));
    }
    std::array<char, 8> bytes{};
    std::memcpy(bytes.data(), body_.data() + at_, size);
    at_ += size;
    const bool swap = (encoding_ == PlyEncoding::kBigEndian) ==
                      (std::endian::native == std::endian::little);
    if (swap) {
      std::reverse(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
    }
    switch (type) {
      case PlyType::kInt8:
        return As<std::int8_t>(bytes);
      case PlyType::kUint8:
        return As<std::uint8_t>(bytes);
      case PlyType::kInt16:
        return As<std::int16_t>(bytes);
      case PlyType::kUint16:
        return As<std::uint16_t>(bytes);
      case PlyType::kInt32:
        return As<std::int32_t>(bytes);
      case PlyType::kUint32:
        return As<std::uint32_t>(bytes);
      case PlyType::kFloat:
        return static_cast<double>(As<float>(bytes));
      case PlyType::kDouble:
        return As<double>(bytes);
    }
    throw LogicError("unknown type of a PLY property");
  }

  template <class T>
  static T As(const std::array<char, 8>& bytes) {
    T value;
    std::memcpy(&value, bytes.data(), sizeof(T));
    return value;
  }

  static bool IsSpace(char c) {
    return c == ' ' || c == '\n' || c == '\r' || c == '\t';
  }

  std::string_view body_;
  std::size_t at_ = 0;
  PlyEncoding encoding_;
  std::int64_t line_number_;
  std::string origin_;
};

int PropertyIndex(const PlyElement& element, std::initializer_list<const char*> names) {
  for (std::size_t i = 0; i < element.properties.size(); ++i) {
    for (const char* name : names) {
      if (element.properties[i].name == name) {
        return static_cast<int>(i);
      }
    }
  }
  return -1;
}

float ToFloat(double value) {
  // What a float can't hold becomes infinite, which CheckMesh names.
  constexpr double kMax = static_cast<double>(std::numeric_limits<float>::max());
  return std::abs(value) <= kMax ? static_cast<float>(value)
                                 : std::numeric_limits<float>::infinity();
}

class PlyParser {
 public:
  PlyParser(std::string_view bytes, const std::string& origin)
      : origin_(origin),
        header_(ParsePlyHeader(bytes, origin)),
        numbers_(bytes, header_, origin) {}

  TriangleMesh Parse() {
    for (const PlyElement& element : header_.elements) {
      numbers_.CheckCount(element.count, element);
      if (element.name == "vertex") {
        ReadVertices(element);
      } else if (element.name == "face") {
        ReadFaces(element);
      } else if (!element.properties.empty()) {  // else any count is of no bytes
        for (std::int64_t i = 0; i < element.count; ++i) {
          ReadRow(element, -1);
        }
      }
    }
    if (mesh_.positions.empty() || mesh_.triangles.empty()) {
      throw BadData(origin_ + ": no vertices or no faces");
    }
    return std::move(mesh_);
  }

 private:
  // One element into row_; the list property of that index goes into list_.
  void ReadRow(const PlyElement& element, int list_index) {
    row_.assign(element.properties.size(), 0);
    for (std::size_t i = 0; i < element.properties.size(); ++i) {
      const PlyProperty& property = element.properties[i];
      if (!property.is_list) {
        row_[i] = numbers_.Next(property.type);
        continue;
      }
      const double count = numbers_.Next(property.count_type);
      if (!(count >= 0)) {
        numbers_.Fail("a list with a negative count");
      }
      const bool keep = static_cast<int>(i) == list_index;
      if (keep) {
        list_.clear();
      }
      for (double k = 0; k < count; ++k) {
        const double value = numbers_.Next(property.type);
        if (keep) {
          list_.push_back(value);
        }
      }
    }
  }

  float Column(int index) const {
    return ToFloat(row_[static_cast<std::size_t>(index)]);
  }

  void ReadVertices(const PlyElement& element) {
    const int x = PropertyIndex(element, {"x"});
    const int y = PropertyIndex(element, {"y"});
    const int z = PropertyIndex(element, {"z"});
    const int nx = PropertyIndex(element, {"nx"});
    const int ny = PropertyIndex(element, {"ny"});
    const int nz = PropertyIndex(element, {"nz"});
    const int u = PropertyIndex(element, {"s", "u", "texture_u"});
    const int v = PropertyIndex(element, {"t", "v", "texture_v"});
    if (x < 0 || y < 0 || z < 0) {
      throw BadData(origin_ + ": vertices without x, y and z");
    }
    const auto count = static_cast<std::size_t>(element.count);
    mesh_.positions.reserve(count);
    for (std::size_t i = 0; i < count; ++i) {
      ReadRow(element, -1);
      mesh_.positions.push_back({Column(x), Column(y), Column(z)});
      if (nx >= 0 && ny >= 0 && nz >= 0) {
        mesh_.normals.push_back({Column(nx), Column(ny), Column(nz)});
      }
      if (u >= 0 && v >= 0) {
        mesh_.uvs.push_back({Column(u), Column(v)});
      }
    }
  }

  void ReadFaces(const PlyElement& element) {
    const int indices = PropertyIndex(element, {"vertex_indices", "vertex_index"});
    if (indices < 0 || !element.properties[static_cast<std::size_t>(indices)].is_list) {
      throw BadData(origin_ + ": faces without a list 'vertex_indices'");
    }
    const double vertex_count = static_cast<double>(mesh_.positions.size());
    for (std::int64_t face = 0; face < element.count; ++face) {
      ReadRow(element, indices);
      for (const double index : list_) {
        if (!(index >= 0 && index < vertex_count)) {
          numbers_.Fail(fmt::format(
              "face {} uses vertex {} of {}", face, index, mesh_.positions.size()));
        }
      }
      for (std::size_t k = 2; k < list_.size(); ++k) {
        mesh_.triangles.push_back({static_cast<std::uint32_t>(list_[0]),
                                   static_cast<std::uint32_t>(list_[k - 1]),
                                   static_cast<std::uint32_t>(list_[k])});
      }
    }
  }

  std::string origin_;
  PlyHeader header_;
  PlyNumbers numbers_;
  std::vector<double> row_;
  std::vector<double> list_;
  TriangleMesh mesh_;
};

}  // namespace

TriangleMesh ParsePly(std::string_view bytes, const std::string& origin) {
  return PlyParser(bytes, origin).Parse();
}

TriangleMesh ReadPly(const std::filesystem::path& path) {
  return ParsePly(ReadFile(path), path.string());
}

}  // namespace nacre::render
