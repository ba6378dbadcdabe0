#include "rigs/laser_tiles.h"

#include "core/simd_clones.h"
#include "rigs/internal/fast_exp2.h"
#include "rigs/internal/gauss_legendre.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace nacre::rigs {
namespace {

constexpr int kLarge = LaserTiles::kBandRows;
constexpr int kSmall = kLarge / 2;

// A tile's points: 3 × 3 nodes, row by row, then the four that test.
constexpr std::size_t kTileNodes = 9;
constexpr std::size_t kPoints = kTileNodes + 4;
constexpr float kTolerance = 3e-3F;  // of log₂ R_d: 0.2 %

// The peak of R_d may be narrower than a pixel: within some pixels of a spot the mean
// over the footprint is taken with a Gauss rule of that many points a side.
struct NearRule {
  double radius_px;
  int order;
};
constexpr std::array kNearRules = {NearRule{2.5, 8}, NearRule{14, 2}};

// Nearer than that tiles aren't tried: the curvature of log R_d is too large.
constexpr double kSmallFromPx = 20;
constexpr double kLargeFromPx = 48;

// log₂ of a tile's exitance is Σ c_ij s^i t^j, i, j = 0 … 2, s and t from 0 to 1.
struct Biquadratic {
  std::array<std::array<float, 3>, 3> c;  // c[j][i]

  explicit Biquadratic(const float* node) {
    std::array<std::array<float, 3>, 3> along_s{};
    for (std::size_t j = 0; j < 3; ++j) {
      along_s[j] = Coefficients(node[3 * j], node[3 * j + 1], node[3 * j + 2]);
    }
    for (std::size_t i = 0; i < 3; ++i) {
      const auto along_t = Coefficients(along_s[0][i], along_s[1][i], along_s[2][i]);
      for (std::size_t j = 0; j < 3; ++j) {
        c[j][i] = along_t[j];
      }
    }
  }
  std::array<float, 3> Row(float t) const {
    std::array<float, 3> row{};
    for (std::size_t i = 0; i < 3; ++i) {
      row[i] = c[0][i] + t * (c[1][i] + t * c[2][i]);
    }
    return row;
  }
  float At(float s, float t) const {
    const std::array<float, 3> row = Row(t);
    return row[0] + s * (row[1] + s * row[2]);
  }

 private:
  // Of the parabola through (0, a), (½, b), (1, c).
  static std::array<float, 3> Coefficients(float a, float b, float c) {
    return {a, 4.0F * b - 3.0F * a - c, 2.0F * (a + c) - 4.0F * b};
  }
};

// The size is known at compile time, so that a row is one or two registers.
template <int kSize>
[[gnu::always_inline]] inline void AddTile(const Biquadratic& log2,
                                           std::size_t stride,
                                           float* __restrict exitance) {
  constexpr float kStep = 1.0F / static_cast<float>(kSize - 1);
  for (int row = 0; row < kSize; ++row) {
    const std::array<float, 3> q = log2.Row(static_cast<float>(row) * kStep);
    for (int k = 0; k < kSize; ++k) {
      const float s = static_cast<float>(k) * kStep;
      exitance[k] += internal::FastExp2(q[0] + s * (q[1] + s * q[2]));
    }
    exitance += stride;
  }
}

NACRE_SIMD_CLONES void AddLargeTile(const Biquadratic& log2,
                                    std::size_t stride,
                                    float* exitance) {
  AddTile<kLarge>(log2, stride, exitance);
}

NACRE_SIMD_CLONES void AddSmallTile(const Biquadratic& log2,
                                    std::size_t stride,
                                    float* exitance) {
  AddTile<kSmall>(log2, stride, exitance);
}

NACRE_SIMD_CLONES void TakeLog2(std::size_t count, float* values) {
  for (std::size_t k = 0; k < count; ++k) {
    values[k] = internal::FastLog2(std::max(values[k], 1e-30F));
  }
}

// Rows and columns of the test points, in pixels from the tile's corner.
std::array<int, 2> TestPixels(int size) {
  return {size / 4, size - 1 - size / 4};
}

}  // namespace

// Columns of points and what comes back; kept by a thread from call to call.
struct LaserTiles::Scratch {
  std::vector<Tile> large;
  std::vector<Tile> small;
  std::vector<Tile> quarters;      // of large ones that aren't smooth
  std::vector<std::size_t> rough;  // corners of small ones that aren't either
  std::vector<std::size_t> pixel;  // to be computed by themselves
  std::vector<std::size_t> near_pixel;
  std::vector<int> near_order;
  std::vector<float> x;
  std::vector<float> y;
  std::vector<float> value;

  void ClearPoints() {
    x.clear();
    y.clear();
  }
  void AddPoint(float px, float py) {
    x.push_back(px);
    y.push_back(py);
  }
  void Evaluate(const Transport& sample, const TileSpot& spot) {
    value.assign(x.size(), 0.0F);
    if (!x.empty()) {
      sample.AddExitance(spot.centre,
                         spot.channel,
                         spot.entering_mw,
                         {x.data(), y.data(), x.size()},
                         value.data());
    }
  }
};

LaserTiles::LaserTiles(const PlaneMap& map, const Transport& sample)
    : map_(map), sample_(sample), pixel_mm_(map.PixelSize()) {}

// At least that far is every pixel of the tile from the spot.
double LaserTiles::Distance(const Tile& tile, PointMm centre) const {
  const std::size_t middle =
      map_.Index(std::min(tile.column + tile.size / 2, map_.width - 1),
                 std::min(tile.row + tile.size / 2, map_.height - 1));
  const double dx = static_cast<double>(map_.x[middle]) - centre.x;
  const double dy = static_cast<double>(map_.y[middle]) - centre.y;
  const double to_middle = std::sqrt(dx * dx + dy * dy);
  constexpr double kSlack = 1.1;  // pixels differ in size over the picture
  return to_middle - kSlack * std::numbers::sqrt2 * 0.5 * (tile.size + 1) * pixel_mm_;
}

// At least that far along y is every pixel of the band. Rows are nearly straight, so
// that their ends and their middle tell, with some slack.
double LaserTiles::BandDistance(int band, PointMm centre) const {
  constexpr double kSlackPx = 16;
  const int first = band * kBandRows;
  const int last = std::min(first + kBandRows, map_.height) - 1;
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  for (const int row : {first, last}) {
    for (const int column : {0, map_.width / 2, map_.width - 1}) {
      const auto y = static_cast<double>(map_.y[map_.Index(column, row)]);
      low = std::min(low, y);
      high = std::max(high, y);
    }
  }
  return std::max(low - centre.y, centre.y - high) - kSlackPx * pixel_mm_;
}

void LaserTiles::AddSmooth(const TileSpot& spot,
                           const std::vector<Tile>& tiles,
                           Scratch& scratch,
                           float* exitance) const {
  scratch.x.resize(tiles.size() * kPoints);
  scratch.y.resize(tiles.size() * kPoints);
  float* x = scratch.x.data();
  float* y = scratch.y.data();
  for (const Tile& tile : tiles) {
    const int last = tile.size - 1;
    const auto add_node = [&](int twice_u,
                              int twice_v) {  // half pixels from the corner
      const int u = tile.column + twice_u / 2;
      const int v = tile.row + twice_v / 2;
      const std::size_t a = map_.Index(u, v);
      const std::size_t b = map_.Index(u + twice_u % 2, v + twice_v % 2);
      *x++ = 0.5F * (map_.x[a] + map_.x[b]);
      *y++ = 0.5F * (map_.y[a] + map_.y[b]);
    };
    for (int j = 0; j < 3; ++j) {
      for (int i = 0; i < 3; ++i) {
        add_node(i * last, j * last);
      }
    }
    for (const int v : TestPixels(tile.size)) {
      for (const int u : TestPixels(tile.size)) {
        add_node(2 * u, 2 * v);
      }
    }
  }
  scratch.Evaluate(sample_, spot);
  TakeLog2(scratch.value.size(), scratch.value.data());
  for (std::size_t k = 0; k < tiles.size(); ++k) {
    const Tile& tile = tiles[k];
    const float* const value = &scratch.value[k * kPoints];
    const Biquadratic log2(value);
    const float per_pixel = 1.0F / static_cast<float>(tile.size - 1);
    const std::array<int, 2> test = TestPixels(tile.size);
    bool smooth = true;
    for (std::size_t n = 0; n < 4; ++n) {
      const float s = static_cast<float>(test[n % 2]) * per_pixel;
      const float t = static_cast<float>(test[n / 2]) * per_pixel;
      smooth = smooth && std::abs(log2.At(s, t) - value[kTileNodes + n]) <= kTolerance;
    }
    if (smooth) {
      const auto add = tile.size == kLarge ? AddLargeTile : AddSmallTile;
      add(log2,
          static_cast<std::size_t>(map_.width),
          exitance + map_.Index(tile.column, tile.row));
    } else if (tile.size == kLarge) {
      for (int n = 0; n < 4; ++n) {
        scratch.quarters.push_back(
            {tile.column + n % 2 * kSmall, tile.row + n / 2 * kSmall, kSmall});
      }
    } else {
      scratch.rough.push_back(map_.Index(tile.column, tile.row));
    }
  }
}

// Small tiles pixel by pixel, all of them far enough from the spot for a pixel to be a
// point.
void LaserTiles::AddRough(const TileSpot& spot,
                          Scratch& scratch,
                          float* exitance) const {
  constexpr auto kSide = static_cast<std::size_t>(kSmall);
  const auto width = static_cast<std::size_t>(map_.width);
  const std::size_t points = scratch.rough.size() * kSide * kSide;
  scratch.x.resize(points);
  scratch.y.resize(points);
  std::size_t at = 0;
  for (const std::size_t corner : scratch.rough) {
    for (std::size_t row = 0; row < kSide; ++row, at += kSide) {
      std::copy_n(&map_.x[corner + row * width], kSide, &scratch.x[at]);
      std::copy_n(&map_.y[corner + row * width], kSide, &scratch.y[at]);
    }
  }
  scratch.Evaluate(sample_, spot);
  at = 0;
  for (const std::size_t corner : scratch.rough) {
    for (std::size_t row = 0; row < kSide; ++row, at += kSide) {
      float* const out = exitance + corner + row * width;
      for (std::size_t k = 0; k < kSide; ++k) {
        out[k] += scratch.value[at + k];
      }
    }
  }
}

void LaserTiles::AddPixels(const TileSpot& spot,
                           Scratch& scratch,
                           float* exitance) const {
  static const std::array rules = {internal::GaussLegendre(kNearRules[0].order),
                                   internal::GaussLegendre(kNearRules[1].order)};
  // Those near the spot leave the others.
  const double near_mm = kNearRules[1].radius_px * pixel_mm_;
  const double nearest_mm = kNearRules[0].radius_px * pixel_mm_;
  scratch.ClearPoints();
  scratch.near_pixel.clear();
  std::size_t plain = 0;
  for (const std::size_t pixel : scratch.pixel) {
    const double dx = static_cast<double>(map_.x[pixel]) - spot.centre.x;
    const double dy = static_cast<double>(map_.y[pixel]) - spot.centre.y;
    if (dx * dx + dy * dy < near_mm * near_mm) {
      scratch.near_pixel.push_back(pixel);
    } else {
      scratch.pixel[plain++] = pixel;
      scratch.AddPoint(map_.x[pixel], map_.y[pixel]);
    }
  }
  scratch.near_order.clear();
  for (const std::size_t pixel : scratch.near_pixel) {
    const auto width = static_cast<std::size_t>(map_.width);
    const double dx = static_cast<double>(map_.x[pixel]) - spot.centre.x;
    const double dy = static_cast<double>(map_.y[pixel]) - spot.centre.y;
    const std::size_t which = dx * dx + dy * dy < nearest_mm * nearest_mm ? 0 : 1;
    scratch.near_order.push_back(static_cast<int>(which));
    for (const double v : rules[which].node) {
      for (const double u : rules[which].node) {
        const PointMm point = map_.At(static_cast<int>(pixel % width),
                                      static_cast<int>(pixel / width),
                                      0.5 * u,
                                      0.5 * v);
        scratch.AddPoint(static_cast<float>(point.x), static_cast<float>(point.y));
      }
    }
  }
  scratch.Evaluate(sample_, spot);
  const float* value = scratch.value.data();
  for (std::size_t k = 0; k < plain; ++k) {
    exitance[scratch.pixel[k]] += *value++;
  }
  for (std::size_t k = 0; k < scratch.near_pixel.size(); ++k) {
    const internal::GaussRule& rule =
        rules[static_cast<std::size_t>(scratch.near_order[k])];
    double mean = 0;
    for (const double b : rule.weight) {
      for (const double a : rule.weight) {
        mean += 0.25 * a * b * static_cast<double>(*value++);
      }
    }
    exitance[scratch.near_pixel[k]] += static_cast<float>(mean);
  }
}

void LaserTiles::AddSpot(const TileSpot& spot, int band, float* exitance) const {
  thread_local Scratch scratch;
  scratch.large.clear();
  scratch.small.clear();
  scratch.quarters.clear();
  scratch.rough.clear();
  scratch.pixel.clear();
  const int first_row = band * kBandRows;
  const int rows = std::min(kBandRows, map_.height - first_row);
  if (BandDistance(band, spot.centre) >= spot.reach_mm) {
    return;
  }
  const auto add_pixels = [&](int column, int row, int width, int height) {
    for (int v = row; v < row + height; ++v) {
      for (int u = column; u < column + width; ++u) {
        scratch.pixel.push_back(map_.Index(u, v));
      }
    }
  };
  for (int column = 0; column < map_.width; column += kLarge) {
    const Tile tile{column, first_row, kLarge};
    const double distance_mm = Distance(tile, spot.centre);
    if (distance_mm >= spot.reach_mm) {
      continue;
    }
    if (rows < kLarge || column + kLarge > map_.width) {
      add_pixels(column, first_row, std::min(kLarge, map_.width - column), rows);
    } else if (distance_mm >= kLargeFromPx * pixel_mm_) {
      scratch.large.push_back(tile);
    } else {
      for (int n = 0; n < 4; ++n) {
        const Tile quarter{column + n % 2 * kSmall, first_row + n / 2 * kSmall, kSmall};
        if (Distance(quarter, spot.centre) >= kSmallFromPx * pixel_mm_) {
          scratch.small.push_back(quarter);
        } else {
          add_pixels(quarter.column, quarter.row, kSmall, kSmall);
        }
      }
    }
  }
  AddSmooth(spot, scratch.large, scratch, exitance);
  scratch.small.insert(
      scratch.small.end(), scratch.quarters.begin(), scratch.quarters.end());
  AddSmooth(spot, scratch.small, scratch, exitance);
  AddRough(spot, scratch, exitance);
  AddPixels(spot, scratch, exitance);
}

}  // namespace nacre::rigs
