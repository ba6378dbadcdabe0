#pragma once

#include "core/error.h"
#include "render/bsdf/bsdfs.h"
#include "render/scene.h"

#include <filesystem>
#include <map>
#include <optional>
#include <pugixml.hpp>
#include <string>
#include <vector>

namespace nacre::render {

/// What instances repeat.
struct ShapeGroup {
  std::size_t first = 0;  ///< of the scene's shapes
  std::size_t count = 0;
  std::vector<Shape> translucent;  ///< each instance has its own
};

/// What all parts of the reader share: the text with its lines, the `$name`s, objects
/// with an id, and the scene being built.
struct Document {
  std::string origin;
  std::string text;
  std::filesystem::path folder;
  /// Where files may be read from, besides; nothing of it: anywhere.
  std::optional<std::vector<std::filesystem::path>> allowed;
  std::vector<std::filesystem::path>
      included;  ///< files now being read, outermost first
  bool has_sensor = false;
  bool has_integrator = false;
  bool lenient = false;
  double material_error = 0;
  std::map<std::string, std::string> defines;
  std::map<std::string, BsdfPtr> bsdfs;            ///< by id
  std::map<std::string, TexturePtr> textures;      ///< by id
  std::map<std::string, MediumPtr> media;          ///< by id
  std::map<std::string, ShapeGroup> shape_groups;  ///< by id
  Scene scene;

  /// "file:line" of a node.
  std::string Where(const pugi::xml_node& node) const;
  Error ErrorAt(const pugi::xml_node& node, const std::string& message) const;
  /// For what isn't known: throws, or with `lenient` makes it a note.
  void Unknown(const pugi::xml_node& node, const std::string& message);
  void Note(const pugi::xml_node& node, const std::string& message);

  /// The value with each $name replaced; "" if the attribute isn't there.
  std::string Attribute(const pugi::xml_node& node, const char* name) const;
  /// As Attribute, but an error if it isn't there.
  std::string RequiredAttribute(const pugi::xml_node& node, const char* name) const;

  /// A file named in the scene: relative to the scene's folder. Must exist, and be one
  /// that scenes may read.
  std::filesystem::path File(const pugi::xml_node& node, const std::string& name);
  /// Throws for a file that scenes may not read: a scene from somewhere else isn't to
  /// look around here.
  void CheckAllowed(const pugi::xml_node& node,
                    const std::filesystem::path& path) const;
};

/// All numbers of a text, separated by blanks and commas. Throws ErrorAt for anything
/// else, and for what isn't finite.
std::vector<double> ParseNumbers(const Document& document,
                                 const pugi::xml_node& node,
                                 const std::string& text);
double ParseNumber(const Document& document,
                   const pugi::xml_node& node,
                   const std::string& text);

}  // namespace nacre::render
