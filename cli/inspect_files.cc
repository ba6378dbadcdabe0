#include "cli/inspect_files.h"

#include "cli/artefact.h"
#include "core/error.h"
#include "core/exr.h"
#include "core/json.h"
#include "core/png.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <regex>
#include <sstream>

namespace nacre::cli {

void ValueRange::Add(double value) {
  if (!std::isfinite(value)) {
    ++bad_count;
    return;
  }
  min = std::min(min, value);
  max = std::max(max, value);
  sum += value;
  ++count;
}

Json ValueRange::ToJson() const {
  Json json =
      count > 0
          ? Json{{"min", min}, {"max", max}, {"mean", sum / static_cast<double>(count)}}
          : Json::object();
  if (bad_count > 0) {
    json["not_finite"] = bad_count;
  }
  return json;
}

Json ProvenanceOf(const std::string& text) {
  if (text.empty() || !Json::accept(text)) {
    return text;
  }
  return Json::parse(text);
}

Json InspectExr(const std::filesystem::path& path) {
  Json parts = Json::array();
  Json provenance;
  for (const ExrPart& part : ReadExr(path)) {
    Json channels = Json::array();
    for (std::size_t c = 0; c < part.channels.size(); ++c) {
      ValueRange range;
      for (std::size_t p = 0; p < part.PixelCount(); ++p) {
        range.Add(static_cast<double>(part.Channel(c)[p]));
      }
      Json channel{{"name", part.channels[c]}};
      channel.update(range.ToJson());
      channels.push_back(channel);
    }
    parts.push_back({{"name", part.name},
                     {"size", {part.width, part.height}},
                     {"channels", channels},
                     {"attributes", part.attributes}});
    const auto found = part.attributes.find("nacre.provenance");
    if (found != part.attributes.end()) {
      provenance = ProvenanceOf(found->second);
    }
  }
  return {{"parts", parts}, {"provenance", provenance}};
}

Json InspectReport(const std::filesystem::path& path) {
  const std::string page = Head(path, 1 << 20);
  const std::string mark = "<meta name=\"nacre.provenance\" content=\"";
  const std::size_t at = page.find(mark);
  const std::size_t end = at == std::string::npos ? at : page.find("\">", at);
  if (end == std::string::npos) {
    throw BadData(path.string() + ": the page's head says nothing of its provenance");
  }
  std::string text = page.substr(at + mark.size(), end - at - mark.size());
  const std::pair<const char*, const char*> escaped[] = {
      {"&quot;", "\""}, {"&lt;", "<"}, {"&gt;", ">"}, {"&amp;", "&"}};
  for (const auto& [from, to] : escaped) {
    text = std::regex_replace(text, std::regex(from), to);
  }
  const Json provenance = ParseJson(text, path.string());
  return {{"of", provenance.value("inputs", Json::array())},
          {"provenance", provenance}};
}

Json InspectExport(const std::filesystem::path& path) {
  return ReadJson(path / "export.json");
}

Json InspectPng(const std::filesystem::path& path) {
  const PngImage image = ReadPng(path);
  ValueRange range;
  for (const std::uint16_t value : image.values) {
    range.Add(value);
  }
  return {{"size", {image.width, image.height}},
          {"channels", image.channel_count},
          {"bits", image.bit_depth},
          {"values", range.ToJson()}};
}

Json InspectPly(const std::filesystem::path& path) {
  constexpr std::size_t kHeaderBytes = 1 << 16;
  std::istringstream header(Head(path, kHeaderBytes));
  Json json = Json::object();
  std::string line;
  while (std::getline(header, line) && !line.starts_with("end_header")) {
    std::istringstream words(line);
    std::string word;
    std::string name;
    std::string value;
    words >> word >> name >> value;
    if (word == "format") {
      json["format"] = fmt::format("{} {}", name, value);
    } else if (word == "element") {
      json[name] = value;
    } else if (word == "property") {
      json["properties"].push_back(line.substr(sizeof("property")));
    }
  }
  if (!header) {
    throw BadData(path.string() + ": a PLY file whose header doesn't end");
  }
  return json;
}

Json InspectObj(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::string line;
  std::array<std::int64_t, 4> counts{};
  std::array<ValueRange, 3> box;
  while (std::getline(file, line)) {
    std::istringstream words(line);
    std::string word;
    words >> word;
    const std::array<const char*, 4> names = {"v", "vt", "vn", "f"};
    const auto found = std::find(names.begin(), names.end(), word);
    if (found == names.end()) {
      continue;
    }
    ++counts[static_cast<std::size_t>(found - names.begin())];
    for (std::size_t k = 0; word == "v" && k < 3; ++k) {
      double value = std::numeric_limits<double>::quiet_NaN();
      words >> value;
      box[k].Add(value);
    }
  }
  return {{"vertices", counts[0]},
          {"texture_coordinates", counts[1]},
          {"normals", counts[2]},
          {"faces", counts[3]},
          {"x", box[0].ToJson()},
          {"y", box[1].ToJson()},
          {"z", box[2].ToJson()}};
}

}  // namespace nacre::cli
