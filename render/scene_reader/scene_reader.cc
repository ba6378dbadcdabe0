#include "core/atomic_file.h"
#include "render/scene.h"
#include "render/scene_reader/objects.h"

namespace nacre::render {
namespace {

constexpr std::uint64_t kMaxSceneBytes = std::uint64_t{256} << 20;

void ReadDefault(Document& document, const pugi::xml_node& node) {
  const std::string name = document.RequiredAttribute(node, "name");
  // A -D of the same name was there first and stays.
  document.defines.try_emplace(name, document.RequiredAttribute(node, "value"));
}

void ReadTopLevel(Document& document, const pugi::xml_node& node) {
  const std::string tag = node.name();
  if (tag == "default") {
    ReadDefault(document, node);
  } else if (tag == "bsdf") {
    ReadBsdf(Element(document, node));
  } else if (tag == "texture") {
    const TexturePtr texture = ReadTexture(Element(document, node));
    document.textures[document.RequiredAttribute(node, "id")] = texture;
  } else if (tag == "emitter") {
    ReadEmitter(Element(document, node));
  } else if (tag == "shape") {
    ReadShape(Element(document, node));
  } else if (tag == "sensor") {
    ReadSensor(Element(document, node));
  } else if (tag == "integrator") {
    ReadIntegrator(Element(document, node));
  } else {
    document.Unknown(node,
                     fmt::format("no element <{}> in a <scene>{}",
                                 tag,
                                 Suggestion(tag,
                                            {"default",
                                             "bsdf",
                                             "texture",
                                             "emitter",
                                             "shape",
                                             "sensor",
                                             "integrator"})));
  }
}

void CheckCount(const Document& document, const pugi::xml_node& root, const char* tag) {
  const auto found = root.children(tag);
  const auto count = std::distance(found.begin(), found.end());
  if (count > 1) {
    throw document.ErrorAt(*std::next(found.begin()),
                           fmt::format("a second <{}>: a scene has one", tag));
  }
}

void ReadScene(Document& document, const pugi::xml_node& root) {
  CheckCount(document, root, "sensor");
  CheckCount(document, root, "integrator");
  if (!root.child("sensor")) {
    throw document.ErrorAt(root, "a scene needs a <sensor>");
  }
  for (const pugi::xml_node& node : root.children()) {
    if (node.type() == pugi::node_element) {
      ReadTopLevel(document, node);
    }
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
  document.lenient = options.lenient;
  document.defines = options.defines;
  document.scene.origin = origin;

  pugi::xml_document parsed;
  const pugi::xml_parse_result result = parsed.load_buffer(
      xml.data(), xml.size(), pugi::parse_default, pugi::encoding_utf8);
  if (!result) {
    const auto offset =
        std::clamp<std::ptrdiff_t>(result.offset, 0, std::ssize(document.text));
    const auto line =
        1 + std::count(document.text.begin(), document.text.begin() + offset, '\n');
    throw BadData(
        fmt::format("{}:{}: not XML: {}", origin, line, result.description()));
  }
  const pugi::xml_node root = parsed.child("scene");
  if (!root) {
    throw BadData(fmt::format("{}:1: no <scene> in it", origin));
  }
  ReadScene(document, root);
  return std::move(document.scene);
}

Scene ReadScene(const std::filesystem::path& path, const SceneOptions& options) {
  const std::string xml = ReadFile(path, kMaxSceneBytes);
  Scene scene = ParseScene(xml, path.string(), path.parent_path(), options);
  scene.files.insert(scene.files.begin(), path);
  return scene;
}

}  // namespace nacre::render
