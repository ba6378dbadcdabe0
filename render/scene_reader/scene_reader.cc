#include "core/atomic_file.h"
#include "render/scene.h"
#include "render/scene_reader/mapping.h"
#include "render/scene_reader/objects.h"

#include <algorithm>
#include <functional>

namespace nacre::render {
namespace {

constexpr std::uint64_t kMaxSceneBytes = std::uint64_t{256} << 20;
constexpr std::size_t kMaxIncludes = 16;

void ReadDefault(Document& document, const pugi::xml_node& node) {
  const std::string name = document.RequiredAttribute(node, "name");
  // A -D of the same name was there first and stays.
  document.defines.try_emplace(name, document.RequiredAttribute(node, "value"));
}

// A scene has one of it, wherever that is.
void ReadOnly(Document& document,
              const pugi::xml_node& node,
              bool& is_there,
              void (*read)(Element)) {
  if (is_there) {
    throw document.ErrorAt(node,
                           fmt::format("a second <{}>: a scene has one", node.name()));
  }
  is_there = true;
  read(Element(document, node));
}

void ReadInclude(Document& document, const pugi::xml_node& node);

void ReadTopLevel(Document& document, const pugi::xml_node& node) {
  const std::string tag = node.name();
  if (tag == "default") {
    ReadDefault(document, node);
  } else if (tag == "include") {
    ReadInclude(document, node);
  } else if (tag == "bsdf") {
    ReadBsdf(Element(document, node));
  } else if (tag == "texture") {
    const TexturePtr texture = ReadTexture(Element(document, node));
    document.textures[document.RequiredAttribute(node, "id")] = texture;
  } else if (tag == "medium") {
    ReadMedium(Element(document, node));
  } else if (tag == "emitter") {
    ReadEmitter(Element(document, node));
  } else if (tag == "shape") {
    ReadShape(Element(document, node));
  } else if (tag == "sensor") {
    ReadOnly(document, node, document.has_sensor, ReadSensor);
  } else if (tag == "integrator") {
    ReadOnly(document, node, document.has_integrator, ReadIntegrator);
  } else {
    document.Unknown(node,
                     fmt::format("no element <{}> in a <scene>{}",
                                 tag,
                                 Suggestion(tag,
                                            {"default",
                                             "include",
                                             "bsdf",
                                             "texture",
                                             "medium",
                                             "emitter",
                                             "shape",
                                             "sensor",
                                             "integrator"})));
  }
}

// Reads all of document.text; `read` gets its <scene>.
void ReadText(Document& document,
              const std::function<void(const pugi::xml_node& root)>& read) {
  const std::string& text = document.text;
  pugi::xml_document parsed;
  const pugi::xml_parse_result result = parsed.load_buffer(
      text.data(), text.size(), pugi::parse_default, pugi::encoding_utf8);
  if (!result) {
    const auto offset = std::clamp<std::ptrdiff_t>(result.offset, 0, std::ssize(text));
    const auto line = 1 + std::count(text.begin(), text.begin() + offset, '\n');
    throw BadData(
        fmt::format("{}:{}: not XML: {}", document.origin, line, result.description()));
  }
  const pugi::xml_node root = parsed.child("scene");
  if (!root) {
    throw BadData(fmt::format("{}:1: no <scene> in it", document.origin));
  }
  read(root);
}

void ReadChildren(Document& document, const pugi::xml_node& root) {
  for (const pugi::xml_node& node : root.children()) {
    if (node.type() == pugi::node_element) {
      ReadTopLevel(document, node);
    }
  }
}

// What is in the other file, as if it stood here. Its paths start at the same folder.
void ReadInclude(Document& document, const pugi::xml_node& node) {
  const std::filesystem::path path = std::filesystem::weakly_canonical(
      document.File(node, document.RequiredAttribute(node, "filename")));
  if (std::find(document.included.begin(), document.included.end(), path) !=
      document.included.end()) {
    throw document.ErrorAt(node,
                           fmt::format("'{}' includes itself, over {} files",
                                       path.filename().string(),
                                       document.included.size()));
  }
  if (document.included.size() >= kMaxIncludes) {
    throw document.ErrorAt(
        node, fmt::format("more than {} files included one in another", kMaxIncludes));
  }
  std::string text = ReadFile(path, kMaxSceneBytes);
  document.included.push_back(path);
  std::string origin = path.string();
  std::swap(document.text, text);
  std::swap(document.origin, origin);
  ReadText(document, [&](const pugi::xml_node& root) { ReadChildren(document, root); });
  std::swap(document.text, text);
  std::swap(document.origin, origin);
  document.included.pop_back();
}

void ReadScene(Document& document, const pugi::xml_node& root) {
  ReadChildren(document, root);
  if (!document.has_sensor) {
    throw document.ErrorAt(root, "a scene needs a <sensor>");
  }
  Scene& scene = document.scene;
  bool light = !scene.lights.empty();
  for (const Shape& shape : scene.shapes) {
    light = light || shape.radiance.has_value();
  }
  if (!light) {
    document.Note(root, "no emitter: the picture will be black");
  }
  if (scene.shapes.empty()) {
    document.Note(root, "no shape: only the background will be seen");
  }
  NoteSmallCores(document);
}

// The scene's folder, and what the caller's definitions name.
std::vector<std::filesystem::path> AllowedPlaces(
    const std::filesystem::path& folder,
    const std::map<std::string, std::string>& defines) {
  const std::filesystem::path base = folder.empty() ? "." : folder;
  std::vector<std::filesystem::path> places{std::filesystem::weakly_canonical(base)};
  for (const auto& define : defines) {
    if (!define.second.empty()) {
      places.push_back(std::filesystem::weakly_canonical(base / define.second));
    }
  }
  return places;
}

}  // namespace

void UnknownPlugin(Element& element, const std::vector<std::string>& known) {
  element.document().Unknown(element.node(),
                             fmt::format("no {} '{}'{}",
                                         element.node().name(),
                                         element.type(),
                                         Suggestion(element.type(), known)));
}

Scene ParseScene(const std::string& xml,
                 const std::string& origin,
                 const std::filesystem::path& folder,
                 const SceneOptions& options) {
  Document document;
  document.origin = origin;
  document.text = xml;
  document.folder = folder;
  document.included = {std::filesystem::weakly_canonical(origin)};
  document.lenient = options.lenient;
  document.material_error = options.material_error;
  document.defines = options.defines;
  if (!options.allow_outside) {
    document.allowed = AllowedPlaces(folder, options.defines);
  }
  document.scene.origin = origin;
  ReadText(document, [&](const pugi::xml_node& root) { ReadScene(document, root); });
  return std::move(document.scene);
}

Scene ReadScene(const std::filesystem::path& path, const SceneOptions& options) {
  const std::string xml = ReadFile(path, kMaxSceneBytes);
  Scene scene = ParseScene(xml, path.string(), path.parent_path(), options);
  scene.files.insert(scene.files.begin(), path);
  return scene;
}

}  // namespace nacre::render
