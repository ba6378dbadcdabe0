#include "reconstruct/cluster_map.h"

#include "core/error.h"
#include "core/exr.h"

#include <array>
#include <cmath>
#include <fmt/format.h>

namespace nacre::reconstruct {
namespace {

// A hue of the circle [0, 1) at three levels of brightness, linear RGB.
std::array<std::uint16_t, 3> ColourOf(int label) {
  constexpr double kGolden = 0.61803398875;
  const double hue = std::fmod(0.02 + kGolden * label, 1.0) * 6;
  const double value =
      std::array<double, 3>{0.85, 0.45, 0.2}[static_cast<std::size_t>(label / 5 % 3)];
  std::array<std::uint16_t, 3> colour{};
  for (std::size_t c = 0; c < 3; ++c) {
    // A trapezium of the hue, shifted by a third of the circle a primary.
    const double at = std::fmod(hue + 4.0 * static_cast<double>(3 - c) + 24, 6.0);
    const double share = std::min(1.0, std::max(0.0, std::abs(3 - at) - 1));
    colour[c] = SrgbFromLinear(static_cast<float>(value * (0.08 + 0.92 * share)));
  }
  return colour;
}

void CheckSize(const RdHeader& header, const Clustering& clustering) {
  Expect(std::ssize(clustering.labels) == header.PointCount(), "a label a grid point");
}

}  // namespace

void WriteClusterMap(const std::filesystem::path& path,
                     const RdHeader& header,
                     const Clustering& clustering,
                     const std::string& provenance) {
  CheckSize(header, clustering);
  ExrPart part;
  part.name = "cluster";
  part.width = header.points_x;
  part.height = header.points_y;
  part.channels = {"cluster"};
  part.values.assign(clustering.labels.begin(), clustering.labels.end());
  part.pixels = ExrPixels::kCodes;
  part.attributes = {{"nacre.kind", "clusters"},
                     {"nacre.version", "1"},
                     {"nacre.pitch_mm", fmt::format("{}", header.pitch_mm)},
                     {"nacre.provenance", provenance}};
  WriteExr(path, {part});
}

PngImage PictureOfClusters(const RdHeader& header,
                           const Clustering& clustering,
                           int scale) {
  CheckSize(header, clustering);
  PngImage picture;
  picture.width = header.points_x * scale;
  picture.height = header.points_y * scale;
  picture.values.reserve(static_cast<std::size_t>(3) *
                         static_cast<std::size_t>(picture.width) *
                         static_cast<std::size_t>(picture.height));
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      const auto colour = ColourOf(clustering.labels[static_cast<std::size_t>(
          std::int64_t{y / scale} * header.points_x + x / scale)]);
      picture.values.insert(picture.values.end(), colour.begin(), colour.end());
    }
  }
  return picture;
}

}  // namespace nacre::reconstruct
