#include "cli/report/html.h"
#include "cli/report/raster.h"
#include "cli/report/sections.h"
#include "core/exr.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>

namespace nacre::cli::report {
namespace {

struct ChannelStats {
  double least = std::numeric_limits<double>::infinity();
  double largest = -std::numeric_limits<double>::infinity();
  double sum = 0;
  std::int64_t finite = 0;
  std::int64_t bad = 0;
};

ChannelStats StatsOf(const ExrPart& part, std::size_t channel) {
  ChannelStats stats;
  const float* const values = part.Channel(channel);
  for (std::size_t p = 0; p < part.PixelCount(); ++p) {
    const auto value = static_cast<double>(values[p]);
    if (!std::isfinite(value)) {
      ++stats.bad;
      continue;
    }
    stats.least = std::min(stats.least, value);
    stats.largest = std::max(stats.largest, value);
    stats.sum += value;
    ++stats.finite;
  }
  return stats;
}

std::string ChannelTable(const std::vector<ExrPart>& parts) {
  std::vector<std::vector<std::string>> rows;
  for (const ExrPart& part : parts) {
    for (std::size_t c = 0; c < part.channels.size(); ++c) {
      const ChannelStats s = StatsOf(part, c);
      const std::string name =
          (part.name.empty() ? "" : part.name + " ") + part.channels[c];
      const bool none = s.finite == 0;
      rows.push_back({Escape(name),
                      none ? "–" : Number(s.least),
                      none ? "–" : Number(s.sum / static_cast<double>(s.finite)),
                      none ? "–" : Number(s.largest),
                      std::to_string(s.bad)});
    }
  }
  return Table({"Channel", "least", "mean", "largest", "not numbers"}, rows);
}

const ExrPart* PartCalled(const std::vector<ExrPart>& parts, const char* name) {
  const auto found = std::find_if(
      parts.begin(), parts.end(), [&](const ExrPart& p) { return p.name == name; });
  return found == parts.end() ? nullptr : &*found;
}

// Relative L2 error of the luminance, from the variances of the pixels' means.
double NoiseOf(const ExrPart& picture, const ExrPart& variance) {
  const std::vector<std::size_t> channels = PictureChannels(picture.channels);
  const double weights[] = {0.2126, 0.7152, 0.0722};  // ITU-R BT.709
  double noise = 0;
  double signal = 0;
  for (std::size_t p = 0; p < picture.PixelCount(); ++p) {
    double luminance = 0;
    for (std::size_t c = 0; c < channels.size(); ++c) {
      luminance += (channels.size() == 3 ? weights[c] : 1) *
                   static_cast<double>(picture.Channel(channels[c])[p]);
    }
    noise += static_cast<double>(variance.values[p]);
    signal += luminance * luminance;
  }
  return signal > 0 ? std::sqrt(noise / signal) : 0;
}

std::string PlaneFigure(const ExrPart& part, const std::string& caption) {
  constexpr int kPlaneSide = 480;
  const ChannelStats stats = StatsOf(part, 0);
  const OwnedPlane small = Shrink(
      {part.width, part.height, {part.Channel(0), part.PixelCount()}}, kPlaneSide);
  return Figure(ImageTag(LinearImage(small.View(), 0, stats.largest), part.name),
                fmt::format("{}, up to {}.", caption, Number(stats.largest)),
                "narrow");
}

}  // namespace

std::string PictureStats(const std::vector<ExrPart>& parts) {
  const ExrPart& picture = parts.front();
  std::string text = ChannelTable(parts);
  std::vector<std::string> figures;
  const ExrPart* const variance = PartCalled(parts, "variance");
  if (variance != nullptr && variance->PixelCount() == picture.PixelCount()) {
    text += fmt::format(
        "<p>Noise: relative L<sup>2</sup> error {} of the brightness, estimated from "
        "the "
        "variance of its samples.</p>",
        Percent(NoiseOf(picture, *variance)));
    figures.push_back(PlaneFigure(*variance, "Variance of a pixel’s mean brightness"));
  }
  if (const ExrPart* const samples = PartCalled(parts, "samples")) {
    figures.push_back(PlaneFigure(*samples, "Samples a pixel"));
  }
  if (!figures.empty()) {
    text += Row(figures);
  }
  const auto made = picture.attributes.find("nacre.provenance");
  return text + (made == picture.attributes.end() ? "" : ProvenanceLine(made->second));
}

}  // namespace nacre::cli::report
