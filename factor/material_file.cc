// *.nacre.exr: five parts, each with the material's own channels, so that every EXR
// viewer shows something sensible:
//   albedo     points_x × points_y                     first: what viewers open
//   row_scale  points_x × points_y
//   factors    (terms · map width) × map height        maps f_j side by side
//   kernels    (kernels · core) × (clusters · core)    kernels h_j, a cluster a row
//   cluster    points_x × points_y, channel Y
// Where the material has steps, values are whole numbers instead, times a step. Maps
// that all channels share are channel Y.
// Everything else is in string attributes of the first part, prefixed "nacre.".

#include "core/error.h"
#include "core/exr.h"
#include "core/hash.h"
#include "core/json.h"
#include "factor/internal/material_codes.h"
#include "factor/material.h"

#include <cmath>
#include <fmt/format.h>

namespace nacre::factor {
namespace {

constexpr const char* kFormat = "material";
constexpr const char* kVersion = "2";
constexpr const char* kOldVersion = "1";  // sums of floats: no form, margin or steps
const std::vector<std::string> kShared{"Y"};

// A sheet of pictures of equal size, `columns` side by side and `rows` below each
// other, in channels. Its values run [channel][row][y][column][x], while the material
// holds them [channel][row][column][y][x] (factor maps: one row of maps; kernels: one
// row a cluster).
struct Sheet {
  int width = 0;
  int height = 0;
  int columns = 1;
  int rows = 1;
  std::size_t channels = 1;

  std::size_t Size() const {
    return channels * static_cast<std::size_t>(rows) *
           static_cast<std::size_t>(columns) * static_cast<std::size_t>(height) *
           static_cast<std::size_t>(width);
  }

  // Calls move(index in the sheet, index in the material).
  template <class Move>
  void ForEach(Move&& move) const {
    const auto w = static_cast<std::size_t>(width);
    const auto h = static_cast<std::size_t>(height);
    const auto n = static_cast<std::size_t>(columns);
    for (std::size_t r = 0; r < channels * static_cast<std::size_t>(rows); ++r) {
      for (std::size_t y = 0; y < h; ++y) {
        for (std::size_t column = 0; column < n; ++column) {
          for (std::size_t x = 0; x < w; ++x) {
            move(((r * h + y) * n + column) * w + x,
                 ((r * n + column) * h + y) * w + x);
          }
        }
      }
    }
  }
};

const std::vector<std::string>& MapChannels(const Material& m) {
  return m.form == Form::kBilinear ? kShared : m.channels;
}

struct Layout {
  Sheet points;  // albedo, row_scale
  Sheet factors;
  Sheet kernels;
  Sheet cluster;
};

Layout LayoutOf(const Material& m) {
  const std::size_t n = m.channels.size();
  return {
      {m.points_x, m.points_y, 1, 1, n},
      {m.MapWidth(), m.MapHeight(), m.terms, 1, static_cast<std::size_t>(m.MapSets())},
      {m.core, m.core, m.KernelCount(), m.cluster_count, n},
      {m.points_x, m.points_y, 1, 1, 1}};
}

template <class T>
ExrPart ToPart(const char* name,
               const Sheet& sheet,
               const std::vector<std::string>& channels,
               const std::vector<T>& values) {
  ExrPart part{name,
               sheet.width * sheet.columns,
               sheet.height * sheet.rows,
               channels,
               std::vector<float>(sheet.Size()),
               {}};
  sheet.ForEach([&](std::size_t in_sheet, std::size_t in_material) {
    part.values[in_sheet] = static_cast<float>(values[in_material]);
  });
  return part;
}

bool FitsHalf(const std::vector<float>& values) {
  return std::all_of(values.begin(), values.end(), [](float value) {
    return value <= 65504 && internal::RoundToHalf(value) == value;
  });
}

std::string Exact(double value) {
  return fmt::format("{}", value);  // the shortest text that reads back the same
}

std::string Join(const std::vector<double>& values) {
  Json list = Json::array();
  for (const double value : values) {
    list.push_back(Exact(value));
  }
  return list.dump();
}

ExrAttributes AttributesOf(const Material& m) {
  Json error = Json::object();
  for (const auto& [key, value] : m.error) {
    error[key] = Exact(value);
  }
  Json curve = Json::array();
  for (const TermsError& point : m.error_curve) {
    curve.push_back({point.terms, Exact(point.relative_l2), Exact(point.log_rms)});
  }
  return {{"nacre.format", kFormat},
          {"nacre.version", kVersion},
          {"nacre.method", m.method},
          {"nacre.form", Name(m.form)},
          {"nacre.margin", std::to_string(m.margin)},
          {"nacre.transform", Name(m.transform)},
          {"nacre.points", fmt::format("{} {}", m.points_x, m.points_y)},
          {"nacre.core", std::to_string(m.core)},
          {"nacre.terms", std::to_string(m.terms)},
          {"nacre.clusters", std::to_string(m.cluster_count)},
          {"nacre.pitch_mm", Exact(m.pitch_mm)},
          {"nacre.eta", Exact(m.eta)},
          {"nacre.units", "mm^-2"},
          {"nacre.channels", Json(m.channels).dump()},
          {"nacre.a", Join(m.a)},
          {"nacre.b", Join(m.b)},
          {"nacre.error", error.dump()},
          {"nacre.error_curve", curve.dump()},
          {"nacre.provenance", m.provenance}};
}

// Of all attributes and values but itself, in the order of the file.
std::string Checksum(const ExrAttributes& attributes,
                     const std::vector<ExrPart>& parts) {
  std::string text;
  for (const auto& [key, value] : attributes) {
    if (key.starts_with("nacre.") && key != "nacre.checksum") {
      text += key + '=' + value + '\n';
    }
  }
  for (const ExrPart& part : parts) {
    text += part.name + ':' +
            HashHex(part.values.data(), part.values.size() * sizeof(float)) + '\n';
  }
  return HashHex(text.data(), text.size());
}

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

Form ParseForm(const AttributeReader& attributes) {
  const std::string& text = attributes.Text("form");
  for (const Form form : {Form::kSum, Form::kBilinear}) {
    if (text == Name(form)) {
      return form;
    }
  }
  throw attributes.At("form", "is '" + text + "', neither 'sum' nor 'bilinear'");
}

Transform ParseTransform(const AttributeReader& attributes) {
  const std::string& text = attributes.Text("transform");
  for (const Transform transform : {Transform::kLinear, Transform::kLog}) {
    if (text == Name(transform)) {
      return transform;
    }
  }
  throw attributes.At("transform", "is '" + text + "', neither 'linear' nor 'log'");
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
  if (attributes.Text("version") != kOldVersion) {
    m.form = ParseForm(attributes);
    const double margin = attributes.Number("margin");
    if (!(margin >= 0 && margin <= m.core && margin == std::floor(margin))) {
      throw attributes.At(
          "margin",
          "is " + attributes.Text("margin") + ", not a count up to the window's");
    }
    m.margin = static_cast<int>(margin);
    if (m.form == Form::kBilinear && m.terms > 1024) {
      throw attributes.At("terms", "is " + attributes.Text("terms") + ", out of range");
    }
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
                        const Sheet& sheet,
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

// OpenEXR sorts channels by name and core/exr.h puts R, G, B first again; the checksum
// is over the order that a reader will find.
std::vector<std::string> FileOrder(std::vector<std::string> channels) {
  const auto rank = [](const std::string& name) {
    return name == "R" ? 0 : name == "G" ? 1 : name == "B" ? 2 : 3;
  };
  std::sort(channels.begin(), channels.end(), [&](const auto& a, const auto& b) {
    return rank(a) != rank(b) ? rank(a) < rank(b) : a < b;
  });
  return channels;
}

void OrderChannels(ExrPart& part) {
  const std::vector<std::string> order = FileOrder(part.channels);
  ExrPart sorted = part;
  for (std::size_t c = 0; c < order.size(); ++c) {
    const auto from = static_cast<std::size_t>(part.FindChannel(order[c]));
    std::copy_n(part.Channel(from), part.PixelCount(), sorted.Channel(c));
  }
  sorted.channels = order;
  part = std::move(sorted);
}

// Numbers as the shortest texts that read back the same.
Json StepsToJson(const Steps& steps, const internal::MaterialCodes& codes) {
  const auto list = [](const std::vector<float>& values) {
    Json texts = Json::array();
    for (const float value : values) {
      texts.push_back(fmt::format("{}", value));
    }
    return texts;
  };
  return {{"f", list(steps.f)},
          {"f_least", Exact(codes.f_least)},
          {"h", list(steps.h)},
          {"h_least", Exact(codes.h_least)},
          {"row_scale", fmt::format("{}", steps.row_scale)}};
}

// Values where the file holds whole numbers; `m` comes with these.
void ReadSteps(const AttributeReader& attributes,
               const std::string& origin,
               Material& m) {
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
  Validate(m, origin);  // a step for each map and channel, before they are used
  internal::Decode(attributes.Parse("steps", json["f_least"]),
                   attributes.Parse("steps", json["h_least"]),
                   m);
}

std::vector<ExrPart> ToParts(const Material& m) {
  const Layout layout = LayoutOf(m);
  ExrAttributes attributes = AttributesOf(m);
  internal::MaterialCodes codes;
  ExrPixels pixels = ExrPixels::kFloat;
  if (!m.steps.empty()) {
    codes = internal::Encode(m);
    attributes["nacre.steps"] = StepsToJson(m.steps, codes).dump();
    pixels = ExrPixels::kCodes;
  }
  const auto values =
      [&](const std::vector<float>& floats,
          const std::vector<float>& coded) -> const std::vector<float>& {
    return m.steps.empty() ? floats : coded;
  };
  std::vector<ExrPart> parts{
      ToPart("albedo", layout.points, m.channels, m.albedo),
      ToPart(
          "row_scale", layout.points, m.channels, values(m.row_scale, codes.row_scale)),
      ToPart("factors", layout.factors, MapChannels(m), values(m.f, codes.f)),
      ToPart("kernels", layout.kernels, m.channels, values(m.h, codes.h)),
      ToPart("cluster", layout.cluster, kShared, m.cluster)};
  for (ExrPart& part : parts) {
    OrderChannels(part);
    part.pixels = pixels;
  }
  if (!m.steps.empty() && FitsHalf(m.albedo)) {
    parts[0].pixels = ExrPixels::kHalf;
  } else {
    parts[0].pixels = ExrPixels::kFloat;
  }
  parts[0].attributes = std::move(attributes);
  parts[0].attributes["nacre.checksum"] = Checksum(parts[0].attributes, parts);
  return parts;
}

}  // namespace

void WriteMaterial(const std::filesystem::path& path, const Material& material) {
  Validate(material, path.string());
  WriteExr(path, ToParts(material));
}

std::int64_t FileBytes(const Material& material) {
  return ExrFileBytes(ToParts(material));
}

Material ReadMaterial(const std::filesystem::path& path) {
  const std::vector<ExrPart> parts = ReadExr(path, std::size_t{4} << 30);
  const ExrAttributes& found = parts.front().attributes;
  const auto format = found.find("nacre.format");
  if (format == found.end() || format->second != kFormat) {
    throw BadData(path.string() +
                  ": is not a material (attribute nacre.format); expected a file that "
                  "'nacre factor' wrote");
  }
  const AttributeReader attributes(found, path.string());
  const std::string& version = attributes.Text("version");
  if (version != kVersion && version != kOldVersion) {
    throw attributes.At("version",
                        "is " + version + "; this build reads " + kOldVersion +
                            " and " + kVersion + ": a newer nacre is needed");
  }
  Material m = ReadAttributes(attributes);
  const Layout layout = LayoutOf(m);
  m.albedo = FromPart<float>(parts, "albedo", layout.points, m.channels, path);
  m.row_scale = FromPart<float>(parts, "row_scale", layout.points, m.channels, path);
  m.f = FromPart<float>(parts, "factors", layout.factors, MapChannels(m), path);
  m.h = FromPart<float>(parts, "kernels", layout.kernels, m.channels, path);
  m.cluster = FromPart<std::uint8_t>(parts, "cluster", layout.cluster, kShared, path);
  if (found.contains("nacre.steps")) {
    ReadSteps(attributes, path.string(), m);
  }
  Validate(m, path.string());
  if (attributes.Text("checksum") != Checksum(found, parts)) {
    throw BadData(path.string() +
                  ": its checksum doesn't match: the file was damaged after it was "
                  "written; make it again with 'nacre factor'");
  }
  return m;
}

}  // namespace nacre::factor
