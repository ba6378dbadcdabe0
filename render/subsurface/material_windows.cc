#include "render/subsurface/material_windows.h"

#include "core/error.h"
#include "core/fresnel.h"

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

/// The slope of what is `here`, between values a pitch to either side: their harmonic
/// mean, 0 at extremes [vanLeer79]; 0 as well where there is no neighbour.
float LimitedSlope(const float* before, float here, const float* after) {
  if (before == nullptr || after == nullptr) {
    return 0;
  }
  const float a = here - *before;
  const float b = *after - here;
  return a * b > 0 ? 2 * a * b / (a + b) : 0;
}

ColorLanes LimitedSlope(const ColorLanes* before,
                        const ColorLanes& here,
                        const ColorLanes* after) {
  ColorLanes slope;
  for (std::size_t c = 0; c < 3 && before != nullptr && after != nullptr; ++c) {
    slope.v[c] = LimitedSlope(&before->v[c], here.v[c], &after->v[c]);
  }
  return slope;
}

ColorLanes Ratio(const ColorLanes& measured, const ColorLanes& profile) {
  ColorLanes q;
  for (std::size_t c = 0; c < 3; ++c) {
    q.v[c] = profile.v[c] > 0 ? measured.v[c] / profile.v[c] : 0;
  }
  return q;
}

struct Nearest {
  int index;
  float beside;
};

/// The grid point nearest to a coordinate, of which whole tiles are left out.
Nearest NearestPoint(float along, int points) {
  const float repeated = along - std::floor(along);
  const float grid = repeated * static_cast<float>(points) - 0.5F;
  const int index = std::clamp(static_cast<int>(std::lround(grid)), 0, points - 1);
  return {index, std::clamp(grid - static_cast<float>(index), -0.5F, 0.5F)};
}

/// What is in the slot; else what `make` makes, which stays there.
template <class T, class Make>
const T& FindOrMake(std::atomic<const T*>& slot, const Make& make) {
  const T* found = slot.load(std::memory_order_acquire);
  if (found != nullptr) {
    return *found;
  }
  // Two threads may have made the same; the first stays.
  std::unique_ptr<const T> made = make();
  return slot.compare_exchange_strong(found, made.get(), std::memory_order_acq_rel)
             ? *made.release()
             : *found;
}

}  // namespace

MaterialWindows::MaterialWindows(std::shared_ptr<const WindowSource> source,
                                 double cache_mb,
                                 const std::array<bool, 3>& colours)
    : source_(std::move(source)),
      channel_of_colour_(ChannelsOfColours(source_->channels)),
      internal_reflectance_(DiffuseFresnelReflectance(1 / source_->eta)),
      radius_(0.5F * static_cast<float>(source_->core)),
      kept_(static_cast<std::size_t>(source_->points_x) *
            static_cast<std::size_t>(source_->points_y)),
      profiles_(kept_.size()) {
  for (std::size_t c = 0; c < 3; ++c) {
    channel_of_colour_[c] = colours[c] ? channel_of_colour_[c] : -1;
  }
  const double cells = static_cast<double>(source_->core) * source_->core;
  kept_most_ = static_cast<std::int64_t>(cache_mb * 1e6 / (sizeof(Cell) * cells));
}

MaterialWindows::~MaterialWindows() {
  for (const auto& window : kept_) {
    delete[] window.load();
  }
  for (const auto& profile : profiles_) {
    delete profile.load();
  }
}

MaterialWindows::Entry MaterialWindows::EntryAt(Vec2 uv) const {
  const Nearest column = NearestPoint(uv.x, source_->points_x);
  const Nearest row = NearestPoint(1 - uv.y, source_->points_y);
  Entry entry;
  entry.window = row.index * source_->points_x + column.index;
  entry.beside = {column.beside, row.beside};
  const bool inner_x = column.index > 0 && column.index + 1 < source_->points_x;
  const bool inner_y = row.index > 0 && row.index + 1 < source_->points_y;
  for (std::size_t c = 0; c < 3; ++c) {
    entry.scale.v[c] = 1;
    if (channel_of_colour_[c] < 0) {
      continue;
    }
    const auto albedo = [&](int di, int dj) {
      return source_->Albedo(channel_of_colour_[c], column.index + di, row.index + dj);
    };
    const float here = albedo(0, 0);
    float change = 0;
    if (inner_x) {
      const float left = albedo(-1, 0);
      const float right = albedo(1, 0);
      change += column.beside * LimitedSlope(&left, here, &right);
    }
    if (inner_y) {
      const float above = albedo(0, -1);
      const float below = albedo(0, 1);
      change += row.beside * LimitedSlope(&above, here, &below);
    }
    entry.scale.v[c] = here > 0 ? std::max(0.0F, 1 + change / here) : 1;
  }
  return entry;
}

int MaterialWindows::PartAt(Vec2 uv) const {
  constexpr float kBorder = 0.03F;
  const Nearest column = NearestPoint(uv.x, source_->points_x);
  const Nearest row = NearestPoint(1 - uv.y, source_->points_y);
  // The neighbours on the side where the light enters.
  const int beyond_x =
      std::clamp(column.index + (column.beside < 0 ? -1 : 1), 0, source_->points_x - 1);
  const int beyond_y =
      std::clamp(row.index + (row.beside < 0 ? -1 : 1), 0, source_->points_y - 1);
  for (const int channel : channel_of_colour_) {
    if (channel < 0) {
      continue;
    }
    const float here = source_->Albedo(channel, column.index, row.index);
    for (const float there : {source_->Albedo(channel, beyond_x, row.index),
                              source_->Albedo(channel, column.index, beyond_y),
                              source_->Albedo(channel, beyond_x, beyond_y)}) {
      if (std::abs(there - here) > kBorder * std::max(here, there)) {
        return row.index * source_->points_x + column.index;
      }
    }
  }
  return -1;
}

ColorLanes MaterialWindows::Mean(int window, int u, int v) const {
  ColorLanes mean;
  for (std::size_t c = 0; c < 3; ++c) {
    if (channel_of_colour_[c] < 0) {
      continue;
    }
    mean.v[c] = source_->Evaluate(channel_of_colour_[c],
                                  window % source_->points_x,
                                  window / source_->points_x,
                                  u,
                                  v);
  }
  return mean;
}

std::vector<ColorLanes> MaterialWindows::Means(int window) const {
  const auto count =
      static_cast<std::size_t>(source_->core) * static_cast<std::size_t>(source_->core);
  std::vector<ColorLanes> means(count);
  std::vector<float> values(count);
  for (std::size_t c = 0; c < 3; ++c) {
    if (channel_of_colour_[c] < 0) {
      continue;
    }
    if (c == 0 || channel_of_colour_[c] != channel_of_colour_[c - 1]) {
      source_->EvaluateWindow(channel_of_colour_[c],
                              window % source_->points_x,
                              window / source_->points_x,
                              values.data());
    }
    for (std::size_t n = 0; n < count; ++n) {
      means[n].v[c] = values[n];
    }
  }
  return means;
}

const WindowProfile& MaterialWindows::ProfileOf(int window) const {
  return FindOrMake(profiles_[static_cast<std::size_t>(window)], [&] {
    return std::make_unique<const WindowProfile>(
        Means(window), source_->core, internal_reflectance_);
  });
}

MaterialWindows::Cell MaterialWindows::MakeCell(
    const Ratios& q, const WindowProfile::Moments& moments) const {
  Cell cell{q.here,
            LimitedSlope(q.left, q.here, q.right),
            LimitedSlope(q.above, q.here, q.below)};
  for (std::size_t c = 0; c < 3; ++c) {
    // P's light may lie up to half a pitch from the cell's middle, so that this keeps
    // the ratio from falling below zero.
    const float steep = std::abs(cell.column.v[c]) + std::abs(cell.row.v[c]);
    if (steep > q.here.v[c]) {
      cell.column.v[c] *= q.here.v[c] / steep;
      cell.row.v[c] *= q.here.v[c] / steep;
    }
    cell.value.v[c] -=
        cell.column.v[c] * moments.column.v[c] + cell.row.v[c] * moments.row.v[c];
  }
  return cell;
}

std::unique_ptr<MaterialWindows::Cell[]> MaterialWindows::Evaluate(int window) const {
  const WindowProfile& profile = ProfileOf(window);
  const int core = source_->core;
  std::vector<ColorLanes> q = Means(window);
  std::vector<WindowProfile::Moments> moments(q.size());
  const auto index = [&](int u, int v) {
    return static_cast<std::size_t>(std::int64_t{v} * core + u);
  };
  for (int v = 0; v < core; ++v) {
    for (int u = 0; u < core; ++u) {
      const std::size_t n = index(u, v);
      moments[n] = profile.OfCell(u - core / 2, v - core / 2);
      q[n] = Ratio(q[n], moments[n].mean);
    }
  }
  auto cells = std::make_unique<Cell[]>(q.size());
  for (int v = 0; v < core; ++v) {
    for (int u = 0; u < core; ++u) {
      const auto there = [&](int x, int y) {
        return x < 0 || y < 0 || x >= core || y >= core ? nullptr : &q[index(x, y)];
      };
      cells[index(u, v)] = MakeCell({q[index(u, v)],
                                     there(u - 1, v),
                                     there(u + 1, v),
                                     there(u, v - 1),
                                     there(u, v + 1)},
                                    moments[index(u, v)]);
    }
  }
  return cells;
}

// The same without the rest of the window.
MaterialWindows::Cell MaterialWindows::EvaluateCell(int window, int u, int v) const {
  const WindowProfile& profile = ProfileOf(window);
  const int core = source_->core;
  std::array<ColorLanes, 4> around;
  const auto there = [&](int x, int y, ColorLanes& q) -> const ColorLanes* {
    if (x < 0 || y < 0 || x >= core || y >= core) {
      return nullptr;
    }
    q = Ratio(Mean(window, x, y), profile.OfCell(x - core / 2, y - core / 2).mean);
    return &q;
  };
  const auto moments = profile.OfCell(u - core / 2, v - core / 2);
  return MakeCell({Ratio(Mean(window, u, v), moments.mean),
                   there(u - 1, v, around[0]),
                   there(u + 1, v, around[1]),
                   there(u, v - 1, around[2]),
                   there(u, v + 1, around[3])},
                  moments);
}

const MaterialWindows::Cell* MaterialWindows::Find(int window) const {
  auto& slot = kept_[static_cast<std::size_t>(window)];
  const Cell* found = slot.load(std::memory_order_acquire);
  if (found != nullptr ||
      evaluated_count_.load(std::memory_order_relaxed) >= kept_most_) {
    return found;
  }
  std::unique_ptr<const Cell[]> made = Evaluate(window);
  // Two threads may have evaluated the same window, to the same values; the first
  // stays.
  if (slot.compare_exchange_strong(found, made.get(), std::memory_order_acq_rel)) {
    evaluated_count_.fetch_add(1, std::memory_order_relaxed);
    return made.release();
  }
  return found;
}

ColorLanes MaterialWindows::At(int window,
                               float squared,
                               float column,
                               float row) const {
  const float x = column + radius_;
  const float y = row + radius_;
  const auto side = static_cast<float>(source_->core);
  if (!(x >= 0 && y >= 0 && x < side && y < side)) {
    return {};
  }
  const int u = static_cast<int>(x);
  const int v = static_cast<int>(y);
  const float across = x - static_cast<float>(u) - 0.5F;
  const float down = y - static_cast<float>(v) - 0.5F;
  const Cell* kept = Find(window);
  const Cell cell =
      kept != nullptr ? kept[v * source_->core + u] : EvaluateCell(window, u, v);
  return ProfileOf(window).At(squared) *
         (cell.value + cell.column * across + cell.row * down);
}

void MaterialWindows::Prefetch(int window,
                               float squared,
                               float column,
                               float row) const {
  const auto w = static_cast<std::size_t>(window);
  const Cell* kept = kept_[w].load(std::memory_order_relaxed);
  // What it holds is read, of `kept` the address alone.
  const WindowProfile* profile = profiles_[w].load(std::memory_order_acquire);
  const int u = static_cast<int>(column + radius_);
  const int v = static_cast<int>(row + radius_);
  if (kept == nullptr || profile == nullptr || u < 0 || v < 0 || u >= source_->core ||
      v >= source_->core) {
    return;
  }
  __builtin_prefetch(&kept[v * source_->core + u]);
  profile->Prefetch(squared);
}

Color MaterialWindows::Albedo(int window) const {
  std::array<float, 3> albedo{};
  for (std::size_t c = 0; c < 3; ++c) {
    if (channel_of_colour_[c] >= 0) {
      albedo[c] = source_->Albedo(channel_of_colour_[c],
                                  window % source_->points_x,
                                  window / source_->points_x);
    }
  }
  return {albedo[0], albedo[1], albedo[2]};
}

}  // namespace nacre::render
