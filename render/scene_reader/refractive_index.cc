#include "render/scene_reader/element.h"
#include "render/scene_reader/words.h"

#include <fmt/format.h>
#include <map>

namespace nacre::render {
namespace {

// At 589 nm; handbook values under the names that Mitsuba scenes use.
const std::map<std::string, double>& Substances() {
  static const std::map<std::string, double> substances = {
      {"vacuum", 1.0},
      {"helium", 1.000036},
      {"hydrogen", 1.000132},
      {"air", 1.000277},
      {"carbon dioxide", 1.00045},
      {"water", 1.3330},
      {"acetone", 1.36},
      {"ethanol", 1.361},
      {"carbon tetrachloride", 1.461},
      {"glycerol", 1.4729},
      {"benzene", 1.501},
      {"silicone oil", 1.52045},
      {"bromine", 1.661},
      {"water ice", 1.31},
      {"fused quartz", 1.458},
      {"pyrex", 1.470},
      {"acrylic glass", 1.49},
      {"polypropylene", 1.49},
      {"bk7", 1.5046},
      {"sodium chloride", 1.544},
      {"amber", 1.55},
      {"pet", 1.575},
      {"diamond", 2.419}};
  return substances;
}

}  // namespace

double Element::RefractiveIndex(const char* name, const std::string& otherwise) {
  const pugi::xml_node node = FindValue(name, {"float", "integer", "string"});
  if (node && std::string(node.name()) != "string") {
    const double index =
        ParseNumber(*document_, node, document_->RequiredAttribute(node, "value"));
    return InRange(*this, name, index, {0.1, 10});
  }
  const std::string substance =
      node ? document_->RequiredAttribute(node, "value") : otherwise;
  const auto found = Substances().find(substance);
  if (found == Substances().end()) {
    std::vector<std::string> known;
    for (const auto& entry : Substances()) {
      known.push_back(entry.first);
    }
    FailAt(name,
           fmt::format("no substance '{}'{}", substance, Suggestion(substance, known)));
  }
  return found->second;
}

}  // namespace nacre::render
