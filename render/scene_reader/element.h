#pragma once

#include "core/options.h"
#include "render/scene_reader/document.h"

#include <optional>
#include <set>
#include <string>
#include <vector>

namespace nacre::render {

inline constexpr Color kWhite{1, 1, 1};

/// An object of the scene (`<bsdf type="…">`, `<film …>`) with its parameters. Each
/// getter marks its parameter as known; Finish() then complains of the ones that nobody
/// asked for, naming the nearest that somebody did.
class Element {
 public:
  Element(Document& document, const pugi::xml_node& node);

  Document& document() const { return *document_; }
  const pugi::xml_node& node() const { return node_; }
  std::string type() const;  ///< the plugin
  std::string id() const;

  /// True if it is there; marks it as known.
  bool Has(const char* name);
  double Float(const char* name, double otherwise);
  int Integer(const char* name, int otherwise);
  bool Boolean(const char* name, bool otherwise);
  std::string String(const char* name, const std::string& otherwise);
  Color Spectrum(const char* name, Color otherwise);
  Vec3 Point(const char* name, Vec3 otherwise);
  /// The identity if it isn't there.
  Transform ToWorld() { return TransformOf("toWorld"); }
  Transform TransformOf(const char* name);
  /// A texture, a colour, or a reference to a texture.
  TexturePtr TextureOr(const char* name, Color otherwise);
  /// As TextureOr, and an error unless all values are in [0, 1].
  TexturePtr Reflectance(const char* name, Color otherwise);
  /// A refractive index, as number or as the name of a substance.
  double RefractiveIndex(const char* name, const std::string& otherwise);
  /// Known, but without effect here: a note says why.
  void Ignore(const char* name, const std::string& why);

  /// The child object of that name, of one of `tags`.
  std::optional<Element> Named(const char* name,
                               std::initializer_list<const char*> tags);
  /// Child objects of that tag without a name.
  std::vector<Element> Objects(const char* tag);

  /// Throws for a parameter or object left over.
  void Finish();

  [[noreturn]] void Fail(const std::string& message) const;
  /// An error at the parameter's own line.
  [[noreturn]] void FailAt(const char* name, const std::string& message) const;

 private:
  pugi::xml_node Find(const char* name);
  pugi::xml_node FindValue(const char* name, std::initializer_list<const char*> tags);
  void CheckChildren() const;

  Document* document_;
  pugi::xml_node node_;
  std::set<std::string> known_;
  std::set<std::string> known_tags_;
};

/// `[−1, 1]`-like checks of a parameter with a message that names it.
double InRange(Element& element, const char* name, double value, Range range);

/// The colour of an <rgb>, <srgb> or <spectrum>.
Color ParseColor(const Document& document, const pugi::xml_node& node);
Transform ParseTransform(const Document& document, const pugi::xml_node& node);

}  // namespace nacre::render
