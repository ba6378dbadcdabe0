#include "render/subsurface/material_windows.h"

#include "core/error.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <string>

namespace nacre::render {
namespace {

std::array<int, 3> ChannelsOfColours(const std::vector<std::string>& names) {
  if (names.size() == 1) {
    return {0, 0, 0};
  }
  if (names.size() != 3) {
    throw BadData(
        fmt::format("a material with {} channels ({}) can't be rendered in colour: it "
                    "takes one, or "
                    "three for red, green and blue",
                    names.size(),
                    fmt::join(names, ", ")));
  }
  // By name if they are called R, G, B; in order if they are called something else.
  std::array<int, 3> channels{0, 1, 2};
  const std::array<const char*, 3> colours{"R", "G", "B"};
  std::array<int, 3> named{};
  for (std::size_t c = 0; c < 3; ++c) {
    const auto found = std::find(names.begin(), names.end(), colours[c]);
    if (found == names.end()) {
      return channels;
    }
    named[c] = static_cast<int>(found - names.begin());
  }
  return named;
}

/// Index along one axis of windows half a pitch apart, for a coordinate in [0, 1).
int NearestWindow(float along, int points) {
  const float repeated = along - std::floor(along);
  const float grid = repeated * static_cast<float>(points) - 0.5F;
  const long nearest = std::lround(2 * grid);
  return std::clamp(static_cast<int>(nearest), 0, 2 * (points - 1));
}

}  // namespace

MaterialWindows::MaterialWindows(std::shared_ptr<const WindowSource> source,
                                 double cache_mb)
    : source_(std::move(source)),
      channel_of_colour_(ChannelsOfColours(source_->channels)),
      columns_(2 * source_->points_x - 1),
      rows_(2 * source_->points_y - 1),
      radius_(static_cast<float>(source_->core / 2 + 1)),
      kept_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_)) {
  const std::size_t lanes = CellCount() + WindowCentre::Nodes().size();
  const double window_bytes = static_cast<double>(sizeof(ColorLanes) * lanes);
  kept_most_ = static_cast<std::int64_t>(cache_mb * 1e6 / window_bytes);
}

MaterialWindows::~MaterialWindows() {
  for (const auto& window : kept_) {
    delete[] window.load();
  }
}

int MaterialWindows::WindowAt(Vec2 uv) const {
  const int column = NearestWindow(uv.x, source_->points_x);
  const int row = NearestWindow(1 - uv.y, source_->points_y);
  return row * columns_ + column;
}

MaterialWindows::Points MaterialWindows::PointsOf(int window) const {
  const int column = window % columns_;
  const int row = window / columns_;
  Points points;
  for (int j = row / 2; j <= (row + 1) / 2; ++j) {
    for (int i = column / 2; i <= (column + 1) / 2; ++i) {
      points.ij[points.count++] = {i, j};
    }
  }
  return points;
}

ColorLanes MaterialWindows::Cell(const Points& points, int u, int v) const {
  ColorLanes sum;
  if (u < 0 || v < 0 || u >= source_->core || v >= source_->core) {
    return sum;
  }
  for (std::size_t p = 0; p < points.count; ++p) {
    for (std::size_t c = 0; c < 3; ++c) {
      sum.v[c] += source_->Evaluate(
          channel_of_colour_[c], points.ij[p][0], points.ij[p][1], u, v);
    }
  }
  return sum * (1 / static_cast<float>(points.count));
}

std::unique_ptr<ColorLanes[]> MaterialWindows::Evaluate(const Points& points) const {
  const int core = source_->core;
  const auto side = static_cast<std::size_t>(core + 2);
  constexpr std::size_t kNodes = WindowCentre::Nodes().size();
  auto window = std::make_unique<ColorLanes[]>(CellCount() + kNodes);
  std::vector<float> values(static_cast<std::size_t>(core * core));
  for (std::size_t p = 0; p < points.count; ++p) {
    for (std::size_t c = 0; c < 3; ++c) {
      const bool same_as_before =
          c > 0 && channel_of_colour_[c] == channel_of_colour_[c - 1];
      if (!same_as_before) {
        source_->EvaluateWindow(
            channel_of_colour_[c], points.ij[p][0], points.ij[p][1], values.data());
      }
      std::size_t n = 0;
      for (std::size_t v = 1; v + 1 < side; ++v) {
        for (std::size_t u = 1; u + 1 < side; ++u) {
          window[v * side + u].v[c] += values[n++];
        }
      }
    }
  }
  for (std::size_t n = 0; n < CellCount(); ++n) {
    window[n] = window[n] * (1 / static_cast<float>(points.count));
  }
  WindowCentre::Cells middle;
  for (int n = 0; n < 25; ++n) {
    const int u = core / 2 + n % 5 - 1;  // in the array with its border
    const int v = core / 2 + n / 5 - 1;
    if (u >= 0 && v >= 0 && u < core + 2 && v < core + 2) {
      middle[static_cast<std::size_t>(n)] =
          window[static_cast<std::size_t>(v) * side + static_cast<std::size_t>(u)];
    }
  }
  const WindowCentre centre(middle);
  std::copy(centre.nodes().begin(), centre.nodes().end(), &window[CellCount()]);
  return window;
}

const ColorLanes* MaterialWindows::Find(int window) const {
  auto& slot = kept_[static_cast<std::size_t>(window)];
  const ColorLanes* found = slot.load(std::memory_order_acquire);
  if (found != nullptr ||
      evaluated_count_.load(std::memory_order_relaxed) >= kept_most_) {
    return found;
  }
  std::unique_ptr<const ColorLanes[]> made = Evaluate(PointsOf(window));
  // Two threads may have evaluated the same window, to the same values; the first
  // stays.
  if (slot.compare_exchange_strong(found, made.get(), std::memory_order_acq_rel)) {
    evaluated_count_.fetch_add(1, std::memory_order_relaxed);
    return made.release();
  }
  return found;
}

ColorLanes MaterialWindows::At(int window, float column, float row) const {
  if (!(std::abs(column) < radius_ && std::abs(row) < radius_)) {
    return {};
  }
  const ColorLanes* kept = Find(window);
  if (WindowCentre::Covers(column, row)) {
    if (kept != nullptr) {
      return WindowCentre::At(kept + CellCount(), column, row);
    }
    const Points points = PointsOf(window);
    WindowCentre::Cells middle;
    for (int n = 0; n < 25; ++n) {
      middle[static_cast<std::size_t>(n)] =
          Cell(points, source_->core / 2 + n % 5 - 2, source_->core / 2 + n / 5 - 2);
    }
    return WindowCentre::At(WindowCentre(middle).nodes().data(), column, row);
  }
  const float x = column + radius_;
  const float y = row + radius_;
  const int u = static_cast<int>(x);
  const int v = static_cast<int>(y);
  const float across = x - static_cast<float>(u);
  const float down = y - static_cast<float>(v);
  if (kept != nullptr) {
    const auto side = static_cast<std::size_t>(source_->core + 2);
    const ColorLanes* cell =
        kept + static_cast<std::size_t>(v) * side + static_cast<std::size_t>(u);
    return Mix(
        Mix(cell[0], cell[1], across), Mix(cell[side], cell[side + 1], across), down);
  }
  const Points points = PointsOf(window);
  return Mix(Mix(Cell(points, u - 1, v - 1), Cell(points, u, v - 1), across),
             Mix(Cell(points, u - 1, v), Cell(points, u, v), across),
             down);
}

void MaterialWindows::Prefetch(int window, float column, float row) const {
  const ColorLanes* kept =
      kept_[static_cast<std::size_t>(window)].load(std::memory_order_acquire);
  if (kept == nullptr || !(std::abs(column) < radius_ && std::abs(row) < radius_) ||
      WindowCentre::Covers(column, row)) {
    return;  // centres are small, and read by patches that are near each other
  }
  const int side = source_->core + 2;
  const ColorLanes* cell = kept + static_cast<int>(row + radius_) * side +
                           static_cast<int>(column + radius_);
  __builtin_prefetch(cell);
  __builtin_prefetch(cell + 1);
  __builtin_prefetch(cell + side);
  __builtin_prefetch(cell + side + 1);
}

Color MaterialWindows::Albedo(int window) const {
  const Points points = PointsOf(window);
  std::array<float, 3> sum{};
  for (std::size_t p = 0; p < points.count; ++p) {
    for (std::size_t c = 0; c < 3; ++c) {
      sum[c] +=
          source_->Albedo(channel_of_colour_[c], points.ij[p][0], points.ij[p][1]);
    }
  }
  return Color{sum[0], sum[1], sum[2]} / static_cast<float>(points.count);
}

}  // namespace nacre::render
