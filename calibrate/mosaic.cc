#include "calibrate/mosaic.h"

#include "acquire/mosaic.h"

#include <algorithm>
#include <cstdint>

namespace nacre::calibrate {
namespace {

// A colour that sees less than this share of what the best one sees brings more of the
// dark's noise than it brings light.
constexpr double kLeastShare = 0.3;

std::array<double, 3> LaserShares(const ColourFilters& filters, int channel) {
  return filters.lasers.at(static_cast<std::size_t>(channel));
}

}  // namespace

void ScaleColours(const std::string& mosaic,
                  const std::array<double, 3>& values,
                  int width_px,
                  std::vector<float>& picture) {
  const auto width = static_cast<std::size_t>(width_px);
  for (std::size_t begin = 0; begin < picture.size(); begin += width) {
    const int row = static_cast<int>(begin / width);
    std::array<float, 2> factor{};
    for (const int x : {0, 1}) {
      factor[static_cast<std::size_t>(x)] = static_cast<float>(
          values[static_cast<std::size_t>(acquire::ColourAt(mosaic, x, row))]);
    }
    for (std::size_t x = 0; x < width; ++x) {
      picture[begin + x] *= factor[x & 1];
    }
  }
}

std::vector<MosaicPlane> PlanesOf(const std::string& mosaic) {
  if (!acquire::IsMosaic(mosaic)) {
    return {MosaicPlane()};
  }
  std::vector<MosaicPlane> planes;
  for (const int row : {0, 1}) {
    for (const int column : {0, 1}) {
      planes.push_back({.column = column,
                        .row = row,
                        .step = 2,
                        .colour = acquire::ColourAt(mosaic, column, row)});
    }
  }
  return planes;
}

std::vector<PlaneShare> SharesOf(const ColourFilters& filters, int channel) {
  std::vector<PlaneShare> shares;
  double sum = 0;
  for (const MosaicPlane& plane : PlanesOf(filters.mosaic)) {
    const double share =
        filters.mosaic.empty()
            ? 1
            : LaserShares(filters, channel)[static_cast<std::size_t>(plane.colour)];
    if (share >= kLeastShare) {
      shares.push_back({plane, share});
      sum += share;
    }
  }
  for (PlaneShare& share : shares) {
    share.weight /= sum;
  }
  return shares;
}

CameraGeometry PlaneCamera(const CameraGeometry& camera, const MosaicPlane& plane) {
  CameraGeometry result = camera;
  const double step = plane.step;
  result.width_px = (camera.width_px - plane.column + plane.step - 1) / plane.step;
  result.height_px = (camera.height_px - plane.row + plane.step - 1) / plane.step;
  result.fx_px = camera.fx_px / step;
  result.fy_px = camera.fy_px / step;
  result.cx_px = (camera.cx_px - plane.column) / step;
  result.cy_px = (camera.cy_px - plane.row) / step;
  return result;
}

void Balance(const std::string& mosaic,
             const std::array<double, 3>& shares,
             int width_px,
             std::vector<float>& picture) {
  if (acquire::IsMosaic(mosaic)) {
    ScaleColours(
        mosaic, {1 / shares[0], 1 / shares[1], 1 / shares[2]}, width_px, picture);
  }
}

std::vector<float> PixelShares(const ColourFilters& filters,
                               int channel,
                               int width_px,
                               int height_px) {
  std::vector<float> shares(
      static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px), 0.0F);
  for (const PlaneShare& share : SharesOf(filters, channel)) {
    const MosaicPlane& plane = share.plane;
    const auto value = static_cast<float>(share.weight * plane.step * plane.step);
    for (int y = plane.row; y < height_px; y += plane.step) {
      for (int x = plane.column; x < width_px; x += plane.step) {
        shares[static_cast<std::size_t>(std::int64_t{y} * width_px + x)] = value;
      }
    }
  }
  return shares;
}

void FillIn(const ColourFilters& filters,
            int channel,
            int width_px,
            std::vector<float>& picture) {
  if (filters.mosaic.empty()) {
    return;
  }
  // Colours that hardly see the laser are replaced: what they are divided by is of no
  // account.
  std::array<double, 3> shares = LaserShares(filters, channel);
  for (double& share : shares) {
    share = std::max(share, kLeastShare);
  }
  Balance(filters.mosaic, shares, width_px, picture);
  const int height_px = static_cast<int>(std::ssize(picture)) / width_px;
  const std::vector<float> used = PixelShares(filters, channel, width_px, height_px);
  const std::vector<float> seen = picture;
  for (int y = 0; y < height_px; ++y) {
    for (int x = 0; x < width_px; ++x) {
      const auto at = static_cast<std::size_t>(std::int64_t{y} * width_px + x);
      if (used[at] > 0) {
        continue;
      }
      float sum = 0;
      float count = 0;
      for (int ny = std::max(0, y - 1); ny <= std::min(height_px - 1, y + 1); ++ny) {
        for (int nx = std::max(0, x - 1); nx <= std::min(width_px - 1, x + 1); ++nx) {
          const auto k = static_cast<std::size_t>(std::int64_t{ny} * width_px + nx);
          const float counts = used[k] > 0 ? 1.0F : 0.0F;
          sum += counts * seen[k];
          count += counts;
        }
      }
      picture[at] = count > 0 ? sum / count : 0.0F;
    }
  }
}

std::vector<float> AmbientMap(const SmoothField& field,
                              const ColourFilters& filters,
                              int width_px,
                              int height_px) {
  if (field.empty()) {
    return {};
  }
  std::vector<float> map = field.Map(width_px, height_px);
  if (!filters.mosaic.empty()) {
    ScaleColours(filters.mosaic, filters.ambient, width_px, map);
  }
  return map;
}

}  // namespace nacre::calibrate
