#pragma once

#include "render/scene_reader/element.h"
#include "render/scene_reader/words.h"

#include <fmt/format.h>
#include <map>
#include <optional>
#include <string>

namespace nacre::render {

/// One function a kind of object; each adds to, or is used by, the document's scene.
TexturePtr ReadTexture(Element element);
/// The pixels of the element's `filename`, made linear by its `gamma`.
Bitmap ReadPicture(Element& element);
BsdfPtr ReadBsdf(Element element);
MediumPtr ReadMedium(Element element);
/// The parameter `name`: a <medium>, or a <ref> to one; null if it isn't there.
MediumPtr ReadMediumOr(Element& element, const char* name);

/// Scattering and absorption, a unit of length that the caller knows.
struct Coefficients {
  Color sigma_s;
  Color sigma_a;
  std::optional<float> eta;  ///< of a medium named by `material`
  Color g{};                 ///< of a medium named by `material`; else 0
};
/// The same as textures.
struct TexturedCoefficients {
  TexturePtr sigma_s;
  TexturePtr sigma_a;
};
/// Nothing if none of them is a texture.
std::optional<TexturedCoefficients> ReadTexturedCoefficients(Element& element);
/// In one of three ways: a named medium (a mm), σ_s
/// and σ_a, or σ_t and the albedo.
Coefficients ReadCoefficients(Element& element);
void ReadEmitter(Element element);
void ReadShape(const Element& element);
/// A shape that isn't in the scene yet; none if its type isn't known.
std::optional<Shape> MakeShape(Element element);
/// The shape after a transform. Throws for a sphere that would be none.
Shape Transformed(const Element& element, Shape shape, const Transform& to_world);
void ReadShapeGroup(Element element);
void ReadInstance(Element element);
void ReadSensor(Element element);
void ReadIntegrator(Element element);
/// Makes the shape translucent, or diffuse where light doesn't spread.
void ReadSubsurface(Element element, Shape& shape);

/// The object that <ref id="…"> of `node` means.
template <class Object>
Object FindById(const Document& document,
                const pugi::xml_node& node,
                const std::map<std::string, Object>& objects,
                const char* kind) {
  const std::string id = document.RequiredAttribute(node, "id");
  const auto found = objects.find(id);
  if (found == objects.end()) {
    std::vector<std::string> known;
    known.reserve(objects.size());
    for (const auto& object : objects) {
      known.push_back(object.first);
    }
    throw document.ErrorAt(
        node,
        fmt::format(
            "no {} with id '{}' above this line{}", kind, id, Suggestion(id, known)));
  }
  return found->second;
}

/// For a plugin that doesn't exist: throws naming the nearest, or notes it.
void UnknownPlugin(Element& element, const std::vector<std::string>& known);

}  // namespace nacre::render
