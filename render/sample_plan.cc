#include "render/sample_plan.h"

#include <algorithm>
#include <cmath>

namespace nacre::render {
namespace {

// Before that many samples a tile's variance isn't known well enough to plan with.
constexpr int kEvenly = 16;
constexpr int kLargestPass = 16;
// Even numbers of samples keep pairs of the sequence together.
constexpr int kStep = 4;
constexpr int kEnough = 65536;

// Of a pixel whose samples spread by `deviation`, at a level v / n².
int WantedSamples(double deviation, double level) {
  const double wanted = deviation / std::sqrt(level);
  return wanted < kEnough ? static_cast<int>(std::ceil(wanted)) : kEnough;
}

// The level at which total(level), which falls with it, is `wanted`.
template <class Total>
double FindLevel(double wanted, Total&& total) {
  double low = 1e-30;
  double high = 1e30;
  constexpr int kSteps = 48;  // to 10⁻¹² of it
  for (int i = 0; i < kSteps; ++i) {
    const double middle = std::sqrt(low * high);
    (total(middle) > wanted ? low : high) = middle;
  }
  return high;
}

}  // namespace

SamplePlan::SamplePlan(const Film& film, const SampleBudget& budget)
    : film_(film),
      budget_(budget),
      tiles_x_((film.crop_width + kTile - 1) / kTile),
      tiles_y_((film.crop_height + kTile - 1) / kTile) {}

std::int64_t SamplePlan::PixelsOf(std::int64_t tile) const {
  const auto x = static_cast<int>(tile % tiles_x_) * kTile;
  const auto y = static_cast<int>(tile / tiles_x_) * kTile;
  return std::int64_t{std::min(kTile, film_.crop_width - x)} *
         std::min(kTile, film_.crop_height - y);
}

std::int64_t SamplePlan::SamplesAtMost() const {
  return std::int64_t{film_.crop_width} * film_.crop_height * budget_.spp;
}

std::int64_t SamplePlan::SamplesUpTo(const std::vector<int>& tiles) const {
  std::int64_t sum = 0;
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    sum += tiles[i] * PixelsOf(static_cast<std::int64_t>(i));
  }
  return sum;
}

std::vector<SamplePlan::Tile> SamplePlan::Survey(const Accumulator& film) const {
  std::vector<Tile> own(static_cast<std::size_t>(TileCount()));
  for (int y = 0; y < film_.crop_height; ++y) {
    for (int x = 0; x < film_.crop_width; ++x) {
      const auto pixel =
          static_cast<std::size_t>(std::int64_t{y} * film_.crop_width + x);
      Tile& tile =
          own[static_cast<std::size_t>(std::int64_t{y / kTile} * tiles_x_ + x / kTile)];
      const double variance = film.LuminanceOf(pixel).variance;
      tile.variance += std::isfinite(variance) ? variance : 0;
      tile.done = static_cast<int>(film.SamplesMade(pixel));
    }
  }
  std::vector<Tile> tiles = own;
  for (int y = 0; y < tiles_y_; ++y) {
    for (int x = 0; x < tiles_x_; ++x) {
      double sum = 0;
      double count = 0;
      for (int j = std::max(0, y - 1); j <= std::min(tiles_y_ - 1, y + 1); ++j) {
        for (int i = std::max(0, x - 1); i <= std::min(tiles_x_ - 1, x + 1); ++i) {
          sum += own[static_cast<std::size_t>(std::int64_t{j} * tiles_x_ + i)].variance;
          ++count;
        }
      }
      Tile& tile = tiles[static_cast<std::size_t>(std::int64_t{y} * tiles_x_ + x)];
      tile.variance = 0.5 * (tile.variance + sum / count);
      tile.pixels = static_cast<double>(PixelsOf(std::int64_t{y} * tiles_x_ + x));
      tile.deviation = std::sqrt(tile.variance / tile.pixels);
    }
  }
  return tiles;
}

std::vector<int> SamplePlan::Uniform(int done) const {
  // Passes grow, so that a first picture is there soon and a time limit is kept
  // closely; powers of two keep each prefix of the samples well spread.
  const int end = std::min(budget_.spp, done + std::clamp(done, 1, kLargestPass));
  return std::vector<int>(static_cast<std::size_t>(TileCount()), end);
}

std::vector<int> SamplePlan::Adapted(const std::vector<Tile>& tiles,
                                     double level) const {
  std::vector<int> next;
  bool more = false;
  for (const Tile& tile : tiles) {
    const int wanted = WantedSamples(tile.deviation, level);
    const int whole = (wanted + kStep / 2) / kStep * kStep;
    next.push_back(std::clamp(whole, tile.done, 2 * tile.done));
    more = more || next.back() > tile.done;
  }
  return more ? next : std::vector<int>();
}

double SamplePlan::LevelForSamples(const std::vector<Tile>& tiles) const {
  return FindLevel(static_cast<double>(SamplesAtMost()), [&](double level) {
    double samples = 0;
    for (const Tile& tile : tiles) {
      samples +=
          tile.pixels * std::max(tile.done, WantedSamples(tile.deviation, level));
    }
    return samples;
  });
}

double SamplePlan::LevelForError(const std::vector<Tile>& tiles, double error2) const {
  // The error grows with the level: its inverse falls.
  return FindLevel(1 / error2, [&](double level) {
    double sum = 0;
    for (const Tile& tile : tiles) {
      sum += tile.variance / std::max(tile.done, WantedSamples(tile.deviation, level));
    }
    return sum > 0 ? 1 / sum : 1e300;
  });
}

// Σ v / n at which to stop, over pixels; 0: never.
double SamplePlan::SquaredErrorAllowed(const Accumulator& film,
                                       const std::vector<Tile>& tiles) const {
  double allowed = 0;
  if (budget_.error_target > 0) {
    for (std::size_t i = 0; i < film.PixelCount(); ++i) {
      const double mean = film.LuminanceOf(i).mean;
      allowed += mean * mean;
    }
    allowed *= budget_.error_target * budget_.error_target;
  } else if (budget_.sampling == Sampling::kAsGoodAsEven) {
    for (const Tile& tile : tiles) {
      allowed += tile.variance / budget_.spp;
    }
  }
  return allowed;
}

std::vector<int> SamplePlan::Next(const Accumulator& film) const {
  const std::vector<Tile> tiles = Survey(film);
  const auto by_done = [](const Tile& a, const Tile& b) { return a.done < b.done; };
  const int least = std::min_element(tiles.begin(), tiles.end(), by_done)->done;
  if (budget_.error_target > 0 && film.RelativeError() <= budget_.error_target) {
    return {};
  }
  if (budget_.sampling == Sampling::kEven || least < kEvenly) {
    return least < budget_.spp ? Uniform(least) : std::vector<int>();
  }
  const double last_level = LevelForSamples(tiles);
  double level = last_level;
  const double allowed = SquaredErrorAllowed(film, tiles);
  if (allowed > 0) {
    level = std::max(level, LevelForError(tiles, allowed));
  }
  // Rounding may leave an error just above what is allowed: then a little more.
  std::vector<int> next = Adapted(tiles, level);
  while (budget_.error_target > 0 && next.empty() && level > last_level) {
    level = std::max(last_level, 0.7 * level);
    next = Adapted(tiles, level);
  }
  return next;
}

}  // namespace nacre::render
