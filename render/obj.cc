#include "render/obj.h"

#include "core/atomic_file.h"
#include "core/error.h"

#include <charconv>
#include <cstdint>
#include <fmt/format.h>
#include <unordered_map>

namespace nacre::render {
namespace {

// Indices of position, texture coordinate and normal; −1: not given.
struct Corner {
  std::int64_t v = -1;
  std::int64_t vt = -1;
  std::int64_t vn = -1;
  bool operator==(const Corner&) const = default;
};

struct CornerHash {
  std::size_t operator()(const Corner& c) const {
    auto mix = static_cast<std::uint64_t>(c.v) * 0x9E3779B97F4A7C15u;
    mix = (mix ^ static_cast<std::uint64_t>(c.vt)) * 0xBF58476D1CE4E5B9u;
    mix = (mix ^ static_cast<std::uint64_t>(c.vn)) * 0x94D049BB133111EBu;
    return mix ^ (mix >> 29);
  }
};

bool IsBlank(char c) {
  return c == ' ' || c == '\t' || c == '\r';
}

class ObjParser {
 public:
  ObjParser(std::string_view text, const std::string& origin)
      : text_(text), origin_(origin) {}

  TriangleMesh Parse() {
    while (!text_.empty()) {
      ++line_number_;
      const std::size_t end = text_.find('\n');
      line_ = text_.substr(0, end);
      text_.remove_prefix(end == std::string_view::npos ? text_.size() : end + 1);
      ParseLine();
    }
    if (mesh_.triangles.empty()) {
      throw BadData(origin_ + ": no face in it; is this an OBJ file?");
    }
    // An attribute that some corners lack is of no use.
    if (corners_without_uv_ > 0) {
      mesh_.uvs.clear();
    }
    if (corners_without_normal_ > 0) {
      mesh_.normals.clear();
    }
    return std::move(mesh_);
  }

 private:
  [[noreturn]] void Fail(const std::string& message) const {
    throw BadData(fmt::format("{}:{}: {}", origin_, line_number_, message));
  }

  std::string_view NextWord() {
    while (!line_.empty() && IsBlank(line_.front())) {
      line_.remove_prefix(1);
    }
    std::size_t size = 0;
    while (size < line_.size() && !IsBlank(line_[size])) {
      ++size;
    }
    const std::string_view word = line_.substr(0, size);
    line_.remove_prefix(size);
    return word;
  }

  float NextFloat() {
    std::string_view word = NextWord();
    if (word.size() > 1 && word[0] == '+' && word[1] != '-') {
      word.remove_prefix(1);  // from_chars takes no plus
    }
    float value = 0;
    const auto [stop, failure] =
        std::from_chars(word.data(), word.data() + word.size(), value);
    if (word.empty()) {
      Fail("a number is missing");
    }
    // Smaller than the smallest float is 0, not an error.
    if (failure == std::errc::invalid_argument || stop != word.data() + word.size()) {
      Fail(fmt::format("'{}' isn't a number", word));
    }
    return failure == std::errc() ? value : 0;
  }

  Vec3 NextVec3() {
    const float x = NextFloat();
    const float y = NextFloat();
    return {x, y, NextFloat()};
  }

  void ParseLine() {
    const std::string_view keyword = NextWord();
    if (keyword == "v") {
      positions_.push_back(NextVec3());
    } else if (keyword == "vt") {
      const float u = NextFloat();
      uvs_.push_back({u, NextFloat()});
    } else if (keyword == "vn") {
      normals_.push_back(NextVec3());
    } else if (keyword == "f") {
      ParseFace();
    }
  }

  void ParseFace() {
    polygon_.clear();
    for (std::string_view word = NextWord(); !word.empty(); word = NextWord()) {
      if (word.front() == '#') {
        break;
      }
      polygon_.push_back(VertexOf(ParseCorner(word)));
    }
    if (polygon_.size() < 3) {
      Fail(fmt::format("a face with {} corners", polygon_.size()));
    }
    for (std::size_t i = 2; i < polygon_.size(); ++i) {
      mesh_.triangles.push_back({polygon_[0], polygon_[i - 1], polygon_[i]});
    }
  }

  // v, v/vt, v//vn or v/vt/vn.
  Corner ParseCorner(std::string_view word) const {
    Corner corner;
    const std::string_view whole = word;
    const auto next = [&](std::size_t count, const char* what) {
      const std::size_t size = std::min(word.find('/'), word.size());
      const std::string_view digits = word.substr(0, size);
      word.remove_prefix(std::min(size + 1, word.size()));
      return digits.empty() ? std::int64_t{-1} : Index(digits, count, what);
    };
    corner.v = next(positions_.size(), "vertex");
    corner.vt = next(uvs_.size(), "texture coordinate");
    corner.vn = next(normals_.size(), "normal");
    if (corner.v < 0 || !word.empty()) {
      Fail(fmt::format("'{}' isn't a corner of a face (v, v/vt, v//vn or v/vt/vn)",
                       whole));
    }
    return corner;
  }

  // From 1 on, or backwards from the last one seen.
  std::int64_t Index(std::string_view digits,
                     std::size_t count,
                     const char* what) const {
    std::int64_t index = 0;
    const char* const end = digits.data() + digits.size();
    const auto [stop, failure] = std::from_chars(digits.data(), end, index);
    if (failure != std::errc() || stop != end) {
      Fail(fmt::format("'{}' isn't an index", digits));
    }
    const auto size = static_cast<std::int64_t>(count);
    const std::int64_t zero_based = index < 0 ? size + index : index - 1;
    if (zero_based < 0 || zero_based >= size) {
      Fail(fmt::format("{} {} of {}", what, index, count));
    }
    return zero_based;
  }

  std::uint32_t VertexOf(const Corner& corner) {
    const auto next = static_cast<std::uint32_t>(mesh_.positions.size());
    const auto [found, added] = vertex_of_corner_.try_emplace(corner, next);
    if (added) {
      if (next == 0xFFFFFFFFu) {
        Fail("more than 2^32 vertices");
      }
      mesh_.positions.push_back(positions_[static_cast<std::size_t>(corner.v)]);
      corners_without_uv_ += corner.vt < 0 ? 1 : 0;
      corners_without_normal_ += corner.vn < 0 ? 1 : 0;
      mesh_.uvs.push_back(corner.vt < 0 ? Vec2{}
                                        : uvs_[static_cast<std::size_t>(corner.vt)]);
      mesh_.normals.push_back(
          corner.vn < 0 ? Vec3{} : normals_[static_cast<std::size_t>(corner.vn)]);
    }
    return found->second;
  }

  std::string_view text_;
  std::string_view line_;
  std::string origin_;
  std::int64_t line_number_ = 0;
  std::vector<Vec3> positions_;
  std::vector<Vec2> uvs_;
  std::vector<Vec3> normals_;
  std::vector<std::uint32_t> polygon_;
  std::unordered_map<Corner, std::uint32_t, CornerHash> vertex_of_corner_;
  std::int64_t corners_without_uv_ = 0;
  std::int64_t corners_without_normal_ = 0;
  TriangleMesh mesh_;
};

}  // namespace

TriangleMesh ParseObj(std::string_view text, const std::string& origin) {
  return ObjParser(text, origin).Parse();
}

TriangleMesh ReadObj(const std::filesystem::path& path) {
  return ParseObj(ReadFile(path), path.string());
}

}  // namespace nacre::render
