#include "render/off.h"

#include "core/error.h"

#include <charconv>
#include <cstdint>
#include <fmt/format.h>

namespace nacre::render {
namespace {

/// Reads words line by line; comments (#) and empty lines are skipped.
class Lines {
 public:
  Lines(std::string_view text, const std::string& origin)
      : rest_(text), origin_(origin) {}

  /// Goes to the next line that says something.
  void Next() {
    do {
      if (rest_.empty()) {
        Fail("the file ends here, in the middle");
      }
      const std::size_t end = rest_.find('\n');
      line_ = rest_.substr(0, end);
      rest_ = end == std::string_view::npos ? "" : rest_.substr(end + 1);
      ++number_;
      line_ = line_.substr(0, line_.find('#'));
      SkipBlanks();
    } while (line_.empty());
  }

  bool AtEndOfLine() const { return line_.empty(); }

  std::string_view Word() {
    const std::size_t end = line_.find_first_of(" \t\r");
    const std::string_view word = line_.substr(0, end);
    line_.remove_prefix(word.size());
    SkipBlanks();
    return word;
  }

  template <class Number>
  Number Value(const char* what) {
    const std::string_view word = Word();
    Number value{};
    const auto [end, error] =
        std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size()) {
      Fail(fmt::format("'{}' where {} is expected", word, what));
    }
    return value;
  }

  [[noreturn]] void Fail(const std::string& message) const {
    throw BadData(fmt::format("{}:{}: {}", origin_, number_, message));
  }

 private:
  void SkipBlanks() {
    const std::size_t start = line_.find_first_not_of(" \t\r");
    line_ = start == std::string_view::npos ? "" : line_.substr(start);
  }

  std::string_view rest_;
  std::string_view line_;
  const std::string& origin_;
  std::int64_t number_ = 0;
};

}  // namespace

TriangleMesh ParseOff(std::string_view text, const std::string& origin) {
  Lines lines(text, origin);
  lines.Next();
  const std::string_view magic = lines.Word();
  if (magic != "OFF") {
    lines.Fail(fmt::format("this isn't an OFF file: it starts with '{}'", magic));
  }
  if (lines.AtEndOfLine()) {
    lines.Next();
  }
  const auto vertex_count = lines.Value<std::uint32_t>("the number of vertices");
  const auto face_count = lines.Value<std::uint32_t>("the number of faces");
  // A vertex or a face takes at least six bytes: a count that can't be true is an error
  // before it is an allocation.
  if ((std::uint64_t{vertex_count} + face_count) * 6 > text.size()) {
    lines.Fail(fmt::format("{} vertices and {} faces don't fit into {} bytes",
                           vertex_count,
                           face_count,
                           text.size()));
  }
  TriangleMesh mesh;
  mesh.positions.resize(vertex_count);
  for (Vec3& p : mesh.positions) {
    lines.Next();
    p.x = lines.Value<float>("a coordinate");
    p.y = lines.Value<float>("a coordinate");
    p.z = lines.Value<float>("a coordinate");
  }
  mesh.triangles.reserve(face_count);
  for (std::uint32_t face = 0; face < face_count; ++face) {
    lines.Next();
    const auto corners = lines.Value<std::uint32_t>("the number of corners");
    if (corners < 3) {
      lines.Fail(fmt::format("a face of {} corners", corners));
    }
    std::array<std::uint32_t, 3> triangle{};
    for (std::uint32_t k = 0; k < corners; ++k) {
      const auto index = lines.Value<std::uint32_t>("a vertex");
      if (index >= vertex_count) {
        lines.Fail(fmt::format("vertex {} of {}, counted from 0", index, vertex_count));
      }
      triangle[k == 0 ? 0 : k == 1 ? 1 : 2] = index;
      if (k >= 2) {
        mesh.triangles.push_back(triangle);
        triangle[1] = index;
      }
    }
  }
  CheckMesh(mesh, origin);
  return mesh;
}

}  // namespace nacre::render
