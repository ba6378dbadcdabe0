#include "render/scene_reader/element.h"

#include "render/scene_reader/objects.h"
#include "render/scene_reader/words.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace nacre::render {
namespace {

const std::vector<std::string>& ValueTags() {
  static const std::vector<std::string> tags = {"integer",
                                                "float",
                                                "string",
                                                "boolean",
                                                "rgb",
                                                "srgb",
                                                "spectrum",
                                                "point",
                                                "vector",
                                                "transform"};
  return tags;
}

const std::vector<std::string>& ObjectTags() {
  static const std::vector<std::string> tags = {"bsdf",
                                                "texture",
                                                "emitter",
                                                "shape",
                                                "sensor",
                                                "film",
                                                "sampler",
                                                "rfilter",
                                                "integrator",
                                                "subsurface",
                                                "medium",
                                                "phase",
                                                "volume",
                                                "ref",
                                                "default"};
  return tags;
}

bool Contains(const std::vector<std::string>& words, const std::string& word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

std::vector<std::string> Together(const std::vector<std::string>& a,
                                  const std::vector<std::string>& b) {
  std::vector<std::string> all = a;
  all.insert(all.end(), b.begin(), b.end());
  return all;
}

}  // namespace

Element::Element(Document& document, const pugi::xml_node& node)
    : document_(&document), node_(node) {
  CheckChildren();
}

// Tags that exist nowhere, text where elements belong, and names given twice.
void Element::CheckChildren() const {
  std::set<std::string> names;
  for (const pugi::xml_node& child : node_.children()) {
    if (child.type() == pugi::node_pcdata || child.type() == pugi::node_cdata) {
      throw document_->ErrorAt(
          child, fmt::format("text inside <{}>: '{}'", node_.name(), child.value()));
    }
    if (child.type() != pugi::node_element) {
      continue;
    }
    const std::string tag = child.name();
    if (!Contains(ValueTags(), tag) && !Contains(ObjectTags(), tag)) {
      document_->Unknown(
          child,
          fmt::format("no element <{}>{}",
                      tag,
                      Suggestion(tag, Together(ValueTags(), ObjectTags()))));
      continue;
    }
    const std::string name = child.attribute("name").as_string();
    if (tag != "default" && !name.empty() && !names.insert(name).second) {
      throw document_->ErrorAt(
          child, fmt::format("'{}' is given twice in this <{}>", name, node_.name()));
    }
    if (Contains(ValueTags(), tag) && name.empty()) {
      throw document_->ErrorAt(child, fmt::format("<{}> needs a name", tag));
    }
  }
}

std::string Element::type() const {
  return document_->RequiredAttribute(node_, "type");
}

std::string Element::id() const {
  return document_->Attribute(node_, "id");
}

pugi::xml_node Element::Find(const char* name) {
  known_.insert(name);
  return node_.find_child([&](const pugi::xml_node& child) {
    return std::string(child.attribute("name").as_string()) == name;
  });
}

pugi::xml_node Element::FindValue(const char* name,
                                  std::initializer_list<const char*> tags) {
  const pugi::xml_node node = Find(name);
  if (!node) {
    return node;
  }
  const std::string tag = node.name();
  if (std::find(tags.begin(), tags.end(), tag) == tags.end()) {
    throw document_->ErrorAt(
        node,
        fmt::format("'{}' is a <{}>; it must be a <{}>", name, tag, *tags.begin()));
  }
  return node;
}

bool Element::Has(const char* name) {
  return static_cast<bool>(Find(name));
}

double Element::Float(const char* name, double otherwise) {
  const pugi::xml_node node = FindValue(name, {"float", "integer"});
  return node ? ParseNumber(
                    *document_, node, document_->RequiredAttribute(node, "value"))
              : otherwise;
}

int Element::Integer(const char* name, int otherwise) {
  const pugi::xml_node node = FindValue(name, {"integer"});
  if (!node) {
    return otherwise;
  }
  const double value =
      ParseNumber(*document_, node, document_->RequiredAttribute(node, "value"));
  if (value != std::floor(value) || std::abs(value) > 2147483647) {
    throw document_->ErrorAt(node, fmt::format("{} isn't a whole number", value));
  }
  return static_cast<int>(value);
}

bool Element::Boolean(const char* name, bool otherwise) {
  const pugi::xml_node node = FindValue(name, {"boolean"});
  if (!node) {
    return otherwise;
  }
  const std::string value = document_->RequiredAttribute(node, "value");
  if (value != "true" && value != "false") {
    throw document_->ErrorAt(node,
                             fmt::format("'{}' is neither true nor false", value));
  }
  return value == "true";
}

std::string Element::String(const char* name, const std::string& otherwise) {
  const pugi::xml_node node = FindValue(name, {"string"});
  return node ? document_->RequiredAttribute(node, "value") : otherwise;
}

Color Element::Spectrum(const char* name, Color otherwise) {
  const pugi::xml_node node = FindValue(name, {"rgb", "srgb", "spectrum"});
  return node ? ParseColor(*document_, node) : otherwise;
}

Vec3 Element::Point(const char* name, Vec3 otherwise) {
  const pugi::xml_node node = FindValue(name, {"point", "vector"});
  if (!node) {
    return otherwise;
  }
  const auto axis = [&](const char* attribute) {
    return static_cast<float>(
        ParseNumber(*document_, node, document_->RequiredAttribute(node, attribute)));
  };
  return {axis("x"), axis("y"), axis("z")};
}

Transform Element::TransformOf(const char* name) {
  const pugi::xml_node node = FindValue(name, {"transform"});
  return node ? ParseTransform(*document_, node) : Transform();
}

TexturePtr Element::TextureOr(const char* name, Color otherwise) {
  const pugi::xml_node node =
      FindValue(name, {"texture", "rgb", "srgb", "spectrum", "ref"});
  if (!node) {
    return MakeConstant(otherwise);
  }
  const std::string tag = node.name();
  if (tag == "texture") {
    return ReadTexture(Element(*document_, node));
  }
  if (tag == "ref") {
    return FindById(*document_, node, document_->textures, "texture");
  }
  return MakeConstant(ParseColor(*document_, node));
}

TexturePtr Element::Reflectance(const char* name, Color otherwise) {
  TexturePtr texture = TextureOr(name, otherwise);
  if (!(MaxComponent(texture->Max()) <= 1.0001F)) {
    FailAt(name,
           fmt::format("'{}' reaches {}: above 1 it would make light",
                       name,
                       MaxComponent(texture->Max())));
  }
  return texture;
}

void Element::Ignore(const char* name, const std::string& why) {
  const pugi::xml_node node = Find(name);
  if (node) {
    document_->Note(node, fmt::format("'{}' has no effect: {}", name, why));
  }
}

std::optional<Element> Element::Named(const char* name,
                                      std::initializer_list<const char*> tags) {
  const pugi::xml_node node = FindValue(name, tags);
  return node ? std::optional(Element(*document_, node)) : std::nullopt;
}

std::vector<Element> Element::Objects(const char* tag) {
  known_tags_.insert(tag);
  std::vector<Element> objects;
  for (const pugi::xml_node& child : node_.children(tag)) {
    if (!child.attribute("name")) {
      objects.emplace_back(*document_, child);
    }
  }
  return objects;
}

void Element::Finish() {
  for (const pugi::xml_node& child : node_.children()) {
    if (child.type() != pugi::node_element) {
      continue;
    }
    const std::string tag = child.name();
    const std::string name = child.attribute("name").as_string();
    if (name.empty()) {
      if (Contains(ObjectTags(), tag) && !known_tags_.contains(tag)) {
        document_->Unknown(
            child, fmt::format("a <{}> has no place in a <{}>", tag, node_.name()));
      }
      continue;
    }
    if (!known_.contains(name)) {
      const std::vector<std::string> known(known_.begin(), known_.end());
      document_->Unknown(child,
                         fmt::format("<{} type=\"{}\"> has no parameter '{}'{}",
                                     node_.name(),
                                     document_->Attribute(node_, "type"),
                                     name,
                                     Suggestion(name, known)));
    }
  }
}

void Element::Fail(const std::string& message) const {
  throw document_->ErrorAt(node_, message);
}

void Element::FailAt(const char* name, const std::string& message) const {
  const pugi::xml_node node = node_.find_child([&](const pugi::xml_node& child) {
    return std::string(child.attribute("name").as_string()) == name;
  });
  throw document_->ErrorAt(node ? node : node_, message);
}

double InRange(Element& element, const char* name, double value, Range range) {
  if (value < range.min || value > range.max) {
    element.FailAt(
        name,
        fmt::format(
            "'{}' is {}; it must be in [{}, {}]", name, value, range.min, range.max));
  }
  return value;
}

}  // namespace nacre::render
