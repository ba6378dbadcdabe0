#include "factor/internal/material_attributes.h"

#include "core/error.h"
#include "core/json.h"
#include "factor/internal/material_layout.h"

#include <cmath>
#include <fmt/format.h>

namespace nacre::factor::internal {
namespace {

// Reads the attributes of one file, naming file and attribute where they make no sense.
class AttributeReader {
 public:
  AttributeReader(const ExrAttributes& attributes, std::string path)
      : attributes_(attributes), path_(std::move(path)) {}

  const std::string& Text(const std::string& name) const {
    const auto found = attributes_.find("nacre." + name);
    if (found == attributes_.end()) {
      throw At(name, "is missing");
    }
    return found->second;
  }

  double Number(const std::string& name) const { return Parse(name, Text(name)); }

  int Integer(const std::string& name) const {
    const double value = Number(name);
    if (!(value >= 1 && value <= 1e6 && value == std::floor(value))) {
      throw At(name, "is " + Text(name) + ", not a count");
    }
    return static_cast<int>(value);
  }

  Json List(const std::string& name) const {
    return ParseJson(Text(name), path_ + ": attribute nacre." + name);
  }

  double Parse(const std::string& name, const std::string& text) const {
    try {
      std::size_t used = 0;
      const double value = std::stod(text, &used);
      if (used == text.size()) {
        return value;
      }
    } catch (const std::exception&) {
      // reported below, as text that is a number only in part
    }
    throw At(name, "is '" + text + "', not a number");
  }

  double Parse(const std::string& name, const Json& json) const {
    if (!json.is_string()) {
      throw At(name, "holds " + json.dump() + " where a number in quotes is expected");
    }
    return Parse(name, json.get<std::string>());
  }

  Error At(const std::string& name, const std::string& problem) const {
    return BadData(fmt::format("{}: attribute nacre.{} {}", path_, name, problem));
  }

 private:
  const ExrAttributes& attributes_;
  std::string path_;
};

void CheckVersion(const AttributeReader& attributes) {
  const std::string& version = attributes.Text("version");
  for (const char* known : {kVersion,
                            kVersionOfOnePart,
                            kVersionWithoutRest,
                            kVersionWithoutOrder,
                            kVersionWithoutTaps,
                            kOldVersion}) {
    if (version == known) {
      return;
    }
  }
  throw attributes.At("version",
                      "is " + version + "; this build reads " + kOldVersion + " to " +
                          kVersion + ": a newer nacre is needed");
}

int ParseCount(const AttributeReader& attributes, const std::string& name, int most) {
  const double count = attributes.Number(name);
  if (!(count >= 0 && count <= most && count == std::floor(count))) {
    throw attributes.At(
        name,
        fmt::format(
            "is {}, not a whole number from 0 to {}", attributes.Text(name), most));
  }
  return static_cast<int>(count);
}

Form ParseForm(const AttributeReader& attributes) {
  const std::string& text = attributes.Text("form");
  for (const Form form : {Form::kSum,
                          Form::kBilinear,
                          Form::kReciprocal,
                          Form::kTucker,
                          Form::kProfiles}) {
    if (text == Name(form)) {
      return form;
    }
  }
  throw attributes.At("form",
                      "is '" + text +
                          "', none of 'sum', 'bilinear', 'reciprocal', 'tucker', "
                          "'profiles'");
}

Transform ParseTransform(const AttributeReader& attributes) {
  const std::string& text = attributes.Text("transform");
  for (const Transform transform :
       {Transform::kLinear, Transform::kSqrt, Transform::kLog}) {
    if (text == Name(transform)) {
      return transform;
    }
  }
  throw attributes.At("transform",
                      "is '" + text + "', none of 'linear', 'sqrt' and 'log'");
}

void ReadErrors(const AttributeReader& attributes, Material& m) {
  const Json errors = attributes.List("error");
  for (const auto& [key, value] : errors.items()) {
    m.error[key] = attributes.Parse("error", value);
  }
  const Json curve = attributes.List("error_curve");
  for (const Json& point : curve) {
    if (!point.is_array() || point.size() != 3 || !point[0].is_number_integer()) {
      throw attributes.At("error_curve", "has an entry " + point.dump());
    }
    m.error_curve.push_back({point[0].get<int>(),
                             attributes.Parse("error_curve", point[1]),
                             attributes.Parse("error_curve", point[2])});
  }
}

Material ReadFields(const AttributeReader& attributes) {
  Material m;
  const std::string& points = attributes.Text("points");
  const auto space = points.find(' ');
  if (space == std::string::npos) {
    throw attributes.At("points", "is '" + points + "', not two counts");
  }
  const double x = attributes.Parse("points", points.substr(0, space));
  const double y = attributes.Parse("points", points.substr(space + 1));
  if (!(x >= 1 && x <= 1e6 && y >= 1 && y <= 1e6)) {
    throw attributes.At("points", "is '" + points + "', out of range");
  }
  m.points_x = static_cast<int>(x);
  m.points_y = static_cast<int>(y);
  m.core = attributes.Integer("core");
  m.terms = attributes.Integer("terms");
  m.cluster_count = attributes.Integer("clusters");
  m.pitch_mm = attributes.Number("pitch_mm");
  m.eta = attributes.Number("eta");
  m.method = attributes.Text("method");
  m.transform = ParseTransform(attributes);
  if (attributes.Text("version") != kOldVersion) {
    m.form = ParseForm(attributes);
    const double margin = attributes.Number("margin");
    if (!(margin >= 0 && margin <= m.core && margin == std::floor(margin))) {
      throw attributes.At(
          "margin",
          "is " + attributes.Text("margin") + ", not a count up to the window's");
    }
    m.margin = static_cast<int>(margin);
    if (m.form != Form::kSum && m.terms > 1024) {
      throw attributes.At("terms", "is " + attributes.Text("terms") + ", out of range");
    }
  }
  const std::string& version = attributes.Text("version");
  const bool has_rest = version == kVersion || version == kVersionOfOnePart;
  const bool has_order = has_rest || version == kVersionWithoutRest;
  if (has_order || version == kVersionWithoutOrder) {
    m.taps = attributes.Integer("taps");
  }
  if (has_rest) {
    m.rest = ParseCount(attributes, "rest", 256);
    m.is_grey = ParseCount(attributes, "grey", 1) == 1;
  }
  if (has_order) {
    m.order = ParseCount(attributes, "order", 8);
    m.sides = ParseCount(attributes, "sides", 1);
  }
  m.provenance = attributes.Text("provenance");
  const Json channels = attributes.List("channels");
  for (const Json& name : channels) {
    if (!name.is_string()) {
      throw attributes.At("channels", "holds " + name.dump() + ", not a name");
    }
    m.channels.push_back(name.get<std::string>());
  }
  const Json a = attributes.List("a");
  for (const Json& value : a) {
    m.a.push_back(attributes.Parse("a", value));
  }
  const Json b = attributes.List("b");
  for (const Json& value : b) {
    m.b.push_back(attributes.Parse("b", value));
  }
  ReadErrors(attributes, m);
  return m;
}

// Steps of the whole numbers that the file holds.
void ReadSteps(const AttributeReader& attributes, MaterialHeader& header) {
  Material& m = header.material;
  const Json json = attributes.List("steps");
  for (const char* key : {"f", "f_least", "h", "h_least", "row_scale"}) {
    if (!json.contains(key)) {
      throw attributes.At("steps", fmt::format("has no '{}'", key));
    }
  }
  for (const auto& [key, steps] : {std::pair{"f", &m.steps.f}, {"h", &m.steps.h}}) {
    for (const Json& step : json[key]) {
      steps->push_back(static_cast<float>(attributes.Parse("steps", step)));
    }
  }
  m.steps.row_scale = static_cast<float>(attributes.Parse("steps", json["row_scale"]));
  // A step for each map and set of kernels, before they are used.
  const auto require = [&](const char* of, std::int64_t found, std::int64_t expected) {
    if (found != expected) {
      throw attributes.At("steps",
                          fmt::format("has as steps of {}: {} values where {} are "
                                      "expected",
                                      of,
                                      found,
                                      expected));
    }
  };
  require("f", std::ssize(m.steps.f), std::int64_t{m.MapSets()} * m.MapCount());
  require("h", std::ssize(m.steps.h), m.KernelSets());
  header.f_least = attributes.Parse("steps", json["f_least"]);
  header.h_least = attributes.Parse("steps", json["h_least"]);
}

void ReadChecksums(const AttributeReader& attributes, MaterialHeader& header) {
  header.checksum = attributes.Text("checksum");
  header.is_whole = attributes.Text("version") != kVersion;
  if (header.is_whole) {
    return;
  }
  const Json parts = attributes.List("parts");
  for (const auto& [name, checksum] : parts.items()) {
    if (!checksum.is_string()) {
      throw attributes.At("parts", "holds " + checksum.dump() + ", not a checksum");
    }
    header.parts[name] = checksum.get<std::string>();
  }
}

}  // namespace

MaterialHeader ReadMaterialHeader(const ExrAttributes& found, const std::string& path) {
  const auto format = found.find("nacre.format");
  if (format == found.end() || format->second != kFormat) {
    throw BadData(path +
                  ": is not a material (attribute nacre.format); expected a file that "
                  "'nacre factor' wrote");
  }
  const AttributeReader attributes(found, path);
  CheckVersion(attributes);
  MaterialHeader header;
  header.material = ReadFields(attributes);
  if (found.contains("nacre.steps")) {
    ReadSteps(attributes, header);
  }
  ReadChecksums(attributes, header);
  return header;
}

}  // namespace nacre::factor::internal
