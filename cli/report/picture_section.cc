#include "cli/report/html.h"
#include "cli/report/raster.h"
#include "cli/report/sections.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/exr.h"
#include "core/json.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace nacre::cli::report {
namespace {

constexpr int kMaxSide =
    1400;  // larger pictures are shown smaller, to keep pages light

bool IsPng(const std::filesystem::path& path) {
  return path.extension() == ".png";
}

struct Shown {
  std::string tag;
  std::string facts;  // for the caption
};

Shown ShowPng(const std::filesystem::path& path, const std::string& css_class) {
  const std::string bytes = ReadFile(path);
  const PngImage image = DecodePng(bytes, path.string());
  return {ImageTag(bytes, path.filename().string(), css_class),
          fmt::format(
              "{} × {} pixels, {} bits", image.width, image.height, image.bit_depth)};
}

// The value that 99.5 % of the pixels stay below: what becomes white.
double WhitePoint(const std::vector<Plane>& planes) {
  std::vector<float> values;
  for (const Plane& plane : planes) {
    for (const float value : plane.values) {
      if (std::isfinite(value)) {
        values.push_back(value);
      }
    }
  }
  if (values.empty()) {
    return 1;
  }
  const auto place =
      values.begin() +
      static_cast<std::ptrdiff_t>(0.995 * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), place, values.end());
  return *place > 0 ? static_cast<double>(*place) : 1;
}

Shown ShowExr(const std::filesystem::path& path, const std::string& css_class) {
  const std::vector<ExrPart> parts = ReadExr(path, std::size_t{2} << 30);
  const ExrPart& part = parts.front();
  if (part.channels.empty()) {
    throw BadData(path.string() + ": has no channel to show");
  }
  std::vector<OwnedPlane> small;
  for (const std::size_t c : PictureChannels(part.channels)) {
    small.push_back(Shrink(
        {part.width, part.height, {part.Channel(c), part.PixelCount()}}, kMaxSide));
  }
  std::vector<Plane> planes;
  planes.reserve(small.size());
  for (const OwnedPlane& plane : small) {
    planes.push_back(plane.View());
  }
  const double white = WhitePoint(planes);
  return {ImageTag(ColorImage(planes, 1 / white), path.filename().string(), css_class),
          fmt::format("{} × {} pixels, channels {}, white is {}",
                      part.width,
                      part.height,
                      Escape(fmt::format("{}", fmt::join(part.channels, ", "))),
                      Number(white))};
}

}  // namespace

std::string PictureFigure(const std::filesystem::path& path,
                          const std::string& css_class) {
  const Shown shown = IsPng(path) ? ShowPng(path, css_class) : ShowExr(path, css_class);
  return Figure(
      shown.tag,
      fmt::format(
          "<code>{}</code>: {}.", Escape(path.filename().string()), shown.facts));
}

std::string PictureSection(const std::filesystem::path& path) {
  const std::string stats =
      IsPng(path) ? "" : PictureStats(ReadExr(path, std::size_t{2} << 30));
  return Section("Picture", "", PictureFigure(path, "") + stats);
}

int ChannelColor(const std::string& name, std::size_t index) {
  return name == "R"   ? 0
         : name == "G" ? 1
         : name == "B" ? 2
                       : static_cast<int>(3 + index % 3);
}

std::vector<std::size_t> PictureChannels(const std::vector<std::string>& channels) {
  std::vector<std::size_t> found;
  for (const char* name : {"R", "G", "B"}) {
    const auto at = std::find(channels.begin(), channels.end(), name);
    if (at == channels.end()) {
      return {0};
    }
    found.push_back(static_cast<std::size_t>(at - channels.begin()));
  }
  return found;
}

std::string ProvenanceLine(const std::string& provenance) {
  if (!Json::accept(provenance)) {
    return "";
  }
  const Json json = Json::parse(provenance);
  if (!json.is_object() || !json.contains("command") || !json.contains("version")) {
    return "";
  }
  std::string text =
      json["command"].is_string() ? json["command"].get<std::string>() : "";
  std::string options;
  if (json.contains("options")) {
    for (const auto& [key, value] : json["options"].items()) {
      if (value.is_primitive()) {
        options += fmt::format(" {}={}", key, value.dump());
      }
    }
  }
  const std::string version =
      json["version"].is_string() ? json["version"].get<std::string>() : "?";
  return fmt::format("<p><code>made by nacre {} {}{}</code></p>\n",
                     Escape(version),
                     Escape(text),
                     Escape(options));
}

}  // namespace nacre::cli::report
