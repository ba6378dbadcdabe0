// Reads *.nacre.exr (internal/material_layout.h) and checks all of it.

#include "core/error.h"
#include "core/exr.h"
#include "core/json.h"
#include "factor/internal/material_codes.h"
#include "factor/internal/material_layout.h"
#include "factor/material.h"

#include <cmath>
#include <fmt/format.h>

namespace nacre::factor {
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

Material ReadAttributes(const AttributeReader& attributes) {
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
  if (attributes.Text("version") != internal::kOldVersion) {
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
  const bool has_order =
      version == internal::kVersion || version == internal::kVersionWithoutRest;
  if (has_order || version == internal::kVersionWithoutOrder) {
    m.taps = attributes.Integer("taps");
  }
  if (version == internal::kVersion) {
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

template <class T>
std::vector<T> FromPart(const std::vector<ExrPart>& parts,
                        const char* name,
                        const internal::Sheet& sheet,
                        const std::vector<std::string>& channels,
                        const std::filesystem::path& path) {
  const ExrPart& part = FindPart(parts, name, path);
  const std::int64_t width = std::int64_t{sheet.width} * sheet.columns;
  const std::int64_t height = std::int64_t{sheet.height} * sheet.rows;
  if (part.width != width || part.height != height ||
      part.channels.size() != channels.size()) {
    throw BadData(
        fmt::format("{}: part '{}' is {} x {} pixels of {} channels where {} x {} of "
                    "{} are expected",
                    path.string(),
                    name,
                    part.width,
                    part.height,
                    part.channels.size(),
                    width,
                    height,
                    channels.size()));
  }
  std::vector<const float*> planes;
  for (const std::string& channel : channels) {
    const int c = part.FindChannel(channel);
    if (c < 0) {
      throw BadData(fmt::format(
          "{}: part '{}' has no channel '{}'", path.string(), name, channel));
    }
    planes.push_back(part.Channel(static_cast<std::size_t>(c)));
  }
  std::vector<T> values(sheet.Size());
  const std::size_t plane_size = part.PixelCount();
  sheet.ForEach([&](std::size_t in_sheet, std::size_t in_material) {
    const float value = planes[in_sheet / plane_size][in_sheet % plane_size];
    if constexpr (std::is_same_v<T, std::uint8_t>) {
      if (!(value >= 0 && value <= 255 && value == std::floor(value))) {
        throw BadData(fmt::format("{}: part '{}' holds {}, not a number of a cluster",
                                  path.string(),
                                  name,
                                  value));
      }
    }
    values[in_material] = static_cast<T>(value);
  });
  return values;
}

// Values where the file holds whole numbers; `m` comes with these.
void ReadSteps(const AttributeReader& attributes, Material& m) {
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
  internal::Decode(attributes.Parse("steps", json["f_least"]),
                   attributes.Parse("steps", json["h_least"]),
                   m);
}

}  // namespace

Material ReadMaterial(const std::filesystem::path& path) {
  const std::vector<ExrPart> parts = ReadExr(path, std::size_t{4} << 30);
  const ExrAttributes& found = parts.front().attributes;
  const auto format = found.find("nacre.format");
  if (format == found.end() || format->second != internal::kFormat) {
    throw BadData(path.string() +
                  ": is not a material (attribute nacre.format); expected a file that "
                  "'nacre factor' wrote");
  }
  const AttributeReader attributes(found, path.string());
  const std::string& version = attributes.Text("version");
  if (version != internal::kVersion && version != internal::kVersionWithoutRest &&
      version != internal::kVersionWithoutOrder &&
      version != internal::kVersionWithoutTaps && version != internal::kOldVersion) {
    throw attributes.At("version",
                        "is " + version + "; this build reads " +
                            internal::kOldVersion + " to " + internal::kVersion +
                            ": a newer nacre is needed");
  }
  Material m = ReadAttributes(attributes);
  const internal::Layout layout = internal::LayoutOf(m);
  m.albedo = FromPart<float>(parts, "albedo", layout.points, m.channels, path);
  m.row_scale = FromPart<float>(parts, "row_scale", layout.points, m.channels, path);
  m.f =
      FromPart<float>(parts, "factors", layout.factors, internal::MapChannels(m), path);
  m.h = FromPart<float>(
      parts, "kernels", layout.kernels, internal::KernelChannels(m), path);
  m.cluster = FromPart<std::uint8_t>(
      parts, "cluster", layout.cluster, internal::SharedChannel(), path);
  if (found.contains("nacre.steps")) {
    ReadSteps(attributes, m);
  }
  Validate(m, path.string());
  if (attributes.Text("checksum") != internal::Checksum(found, parts)) {
    throw BadData(path.string() +
                  ": its checksum doesn't match: the file was damaged after it was "
                  "written; make it again with 'nacre factor'");
  }
  return m;
}

}  // namespace nacre::factor
