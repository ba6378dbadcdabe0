#include "core/png.h"
#include "render/scene_reader/element.h"
#include "render/scene_reader/words.h"

#include <array>
#include <charconv>
#include <cstring>
#include <fmt/format.h>

namespace nacre::render {
namespace {

Color FromSrgb(Color c) {
  return {LinearFromSrgb(c.x), LinearFromSrgb(c.y), LinearFromSrgb(c.z)};
}

Color ParseHexColor(const Document& document,
                    const pugi::xml_node& node,
                    const std::string& text) {
  unsigned value = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, failure] = std::from_chars(text.data() + 1, end, value, 16);
  if (failure != std::errc() || stop != end || text.size() != 7) {
    throw document.ErrorAt(node, fmt::format("'{}' isn't a colour like #8040ff", text));
  }
  const auto channel = [&](unsigned shift) {
    return static_cast<float>((value >> shift) & 255u) / 255.0F;
  };
  return {channel(16), channel(8), channel(0)};
}

Vec3 ParseXyz(const Document& document, const pugi::xml_node& node, double otherwise) {
  const auto axis = [&](const char* name) {
    return node.attribute(name)
               ? ParseNumber(document, node, document.Attribute(node, name))
               : otherwise;
  };
  return {static_cast<float>(axis("x")),
          static_cast<float>(axis("y")),
          static_cast<float>(axis("z"))};
}

Vec3 ParseTriple(const Document& document,
                 const pugi::xml_node& node,
                 const char* attribute) {
  const std::vector<double> v =
      ParseNumbers(document, node, document.RequiredAttribute(node, attribute));
  if (v.size() != 3) {
    throw document.ErrorAt(
        node, fmt::format("'{}' needs three numbers, not {}", attribute, v.size()));
  }
  return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

Transform ParseMatrix(const Document& document, const pugi::xml_node& node) {
  const std::vector<double> v =
      ParseNumbers(document, node, document.RequiredAttribute(node, "value"));
  if (v.size() != 16) {
    throw document.ErrorAt(node,
                           fmt::format("a matrix needs 16 numbers, not {}", v.size()));
  }
  std::array<double, 16> rows{};
  std::copy(v.begin(), v.end(), rows.begin());
  if (rows[12] != 0 || rows[13] != 0 || rows[14] != 0 || rows[15] != 1) {
    throw document.ErrorAt(node, "the last row of a matrix must be 0 0 0 1");
  }
  return Transform(rows);
}

Transform ParseStep(const Document& document, const pugi::xml_node& step) {
  const std::string tag = step.name();
  if (tag == "translate") {
    const Vec3 t = ParseXyz(document, step, 0);
    return Transform::Translate(
        static_cast<double>(t.x), static_cast<double>(t.y), static_cast<double>(t.z));
  }
  if (tag == "scale") {
    Vec3 s = ParseXyz(document, step, 1);
    if (step.attribute("value")) {
      const float all = static_cast<float>(
          ParseNumber(document, step, document.Attribute(step, "value")));
      s = {all, all, all};
    }
    return Transform::Scale(
        static_cast<double>(s.x), static_cast<double>(s.y), static_cast<double>(s.z));
  }
  if (tag == "rotate") {
    return Transform::Rotate(
        ParseXyz(document, step, 0),
        ParseNumber(document, step, document.RequiredAttribute(step, "angle")));
  }
  if (tag == "matrix") {
    return ParseMatrix(document, step);
  }
  if (tag == "lookat" || tag == "lookAt") {
    const Vec3 up =
        step.attribute("up") ? ParseTriple(document, step, "up") : Vec3{0, 1, 0};
    return Transform::LookAt(ParseTriple(document, step, "origin"),
                             ParseTriple(document, step, "target"),
                             up);
  }
  throw document.ErrorAt(
      step,
      fmt::format(
          "no transform <{}>{}",
          tag,
          Suggestion(tag, {"translate", "rotate", "scale", "matrix", "lookat"})));
}

}  // namespace

Color ParseColor(const Document& document, const pugi::xml_node& node) {
  const std::string tag = node.name();
  const std::string text = document.RequiredAttribute(node, "value");
  const bool srgb = tag == "srgb";
  Color color;
  if (tag != "spectrum" && !text.empty() && text[0] == '#') {
    return FromSrgb(ParseHexColor(document, node, text));
  }
  if (tag == "spectrum" && text.find(':') != std::string::npos) {
    throw document.ErrorAt(node,
                           "spectra by wavelength aren't rendered: give an <rgb>");
  }
  const std::vector<double> v = ParseNumbers(document, node, text);
  if (v.size() == 1) {
    const float grey = static_cast<float>(v[0]);
    color = {grey, grey, grey};
  } else if (v.size() == 3) {
    color = {
        static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
  } else {
    throw document.ErrorAt(
        node, fmt::format("a colour needs one or three numbers, not {}", v.size()));
  }
  if (std::min(color.x, std::min(color.y, color.z)) < 0) {
    throw document.ErrorAt(node, "a colour below 0");
  }
  return srgb ? FromSrgb(color) : color;
}

Transform ParseTransform(const Document& document, const pugi::xml_node& node) {
  Transform all;
  for (const pugi::xml_node& step : node.children()) {
    if (step.type() != pugi::node_element) {
      continue;
    }
    try {
      all = ParseStep(document, step) * all;  // each one after those above it
    } catch (const Error& e) {
      // Steps are checked by Transform too, which knows no lines.
      const std::string where = document.Where(step) + ": ";
      const std::string message = e.what();
      throw message.starts_with(where) ? e : BadData(where + message);
    }
  }
  return all;
}

}  // namespace nacre::render
