#include "rigs/transport/diffusion/neighbourhoods.h"

#include <cmath>
#include <map>
#include <utility>

namespace nacre::rigs::diffusion {
namespace {

constexpr int kTile = 4;

// Rounds down, for negative numbers too.
int TileOf(int index) {
  return index >= 0 ? index / kTile : -((kTile - 1 - index) / kTile);
}

}  // namespace

Neighbourhood AloneAt(PointMm point) {
  return {.first = point, .columns = 1, .rows = 1, .points = {point}, .indices = {0}};
}

std::vector<Neighbourhood> GroupPoints(std::span<const PointMm> points,
                                       const acquire::GridDescription& grid,
                                       std::size_t most) {
  std::vector<Neighbourhood> places;
  std::map<std::pair<int, int>, std::size_t> open;  // tile → its last neighbourhood
  for (std::size_t k = 0; k < points.size(); ++k) {
    // From the grid's lower left point, upwards.
    const double u = points[k].x / grid.pitch_mm + 0.5 * (grid.points_x - 1);
    const double v = points[k].y / grid.pitch_mm + 0.5 * (grid.points_y - 1);
    const int i = static_cast<int>(std::lround(u));
    const int j = static_cast<int>(std::lround(v));
    if (std::hypot(u - i, v - j) > 1e-6) {
      places.push_back(AloneAt(points[k]));
      places.back().indices = {k};
      continue;
    }
    const std::pair tile{TileOf(i), TileOf(j)};
    auto at = open.find(tile);
    if (at == open.end() || places[at->second].points.size() >= most) {
      open[tile] = places.size();
      const auto position = [&](int index, int count) {
        return (kTile * index - 0.5 * (count - 1)) * grid.pitch_mm;
      };
      places.push_back({.first = {position(tile.first, grid.points_x),
                                  position(tile.second, grid.points_y)},
                        .columns = kTile,
                        .rows = kTile,
                        .points = {},
                        .indices = {}});
      at = open.find(tile);
    }
    places[at->second].points.push_back(points[k]);
    places[at->second].indices.push_back(k);
  }
  return places;
}

}  // namespace nacre::rigs::diffusion
