#include "render/lit_points.h"

#include "core/parallel.h"
#include "core/ranks.h"
#include "render/entering_light.h"
#include "render/warp.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <span>
#include <string>

namespace nacre::render {
namespace {

constexpr std::int64_t kBlock = 256;

// Density falls by 4 from level to level.
constexpr int kLitLevels = 5;
// Level 1 starts at twice that many patches from what is seen, level 2 at 4 times, …
constexpr float kDensePatches = 3;
// A triangle with more points than this has levels of its own for each of them.
constexpr std::int64_t kLargeTriangle = 64;

// Where a point is, before it sees any light.
struct Place {
  std::uint32_t triangle;
  std::uint32_t index;  ///< of the Sobol' sequence
  std::uint8_t level;
  float parts;  ///< of the area, that it stands for: points if none were left out
};

SurfaceHit PlacePoint(const Shape& shape, std::uint32_t triangle, std::uint32_t index) {
  const Vec2 u = SobolPoint(index);
  if (const auto* sphere = std::get_if<Sphere>(&shape.geometry)) {
    return SpherePoint(shape, sphere->center + SquareToSphere(u) * sphere->radius);
  }
  return MeshPoint(shape, triangle, SquareToTriangle(u));
}

// Spreads points over a shape, densely where it is seen.
class Placement {
 public:
  Placement(const Shape& shape, const SeenPlaces* seen, float patch)
      : shape_(shape), seen_(seen), dense_(kDensePatches * patch) {}

  std::vector<Place> Spread(double count) {
    if (const auto* mesh = std::get_if<TriangleMesh>(&shape_.geometry)) {
      SpreadOverMesh(*mesh, count);
    } else {
      SpreadInPlace(0, static_cast<std::int64_t>(std::ceil(count)));
    }
    if (places_.empty()) {  // a surface smaller than half a patch
      places_.push_back({0, 0, 0, 1});
    }
    return std::move(places_);
  }

  std::int64_t full_count() const { return full_count_; }

 private:
  // Triangle after triangle, as many points as its area deserves; remainders carry
  // over, so that each stretch of the surface is off by less than one point.
  void SpreadOverMesh(const TriangleMesh& mesh, double count) {
    const double per_area = count / SurfaceArea(mesh);
    std::array<double, kLitLevels> due;
    due.fill(0.5);
    double full_due = 0.5;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
      const auto triangle = static_cast<std::uint32_t>(i);
      const double wanted = per_area * static_cast<double>(mesh.TriangleArea(i));
      full_due += wanted;
      const auto whole = static_cast<std::int64_t>(full_due);
      full_due -= static_cast<double>(whole);
      if (seen_ != nullptr && whole > kLargeTriangle) {
        SpreadInPlace(triangle, whole);
        continue;
      }
      const auto& t = mesh.triangles[i];
      const int level = LevelAt(
          (mesh.positions[t[0]] + mesh.positions[t[1]] + mesh.positions[t[2]]) / 3);
      double& at_level = due[static_cast<std::size_t>(level)];
      at_level += std::ldexp(wanted, -2 * level);
      const double points = std::floor(at_level);
      at_level -= points;
      full_count_ += whole;
      for (double k = 0; k < points; ++k) {
        places_.push_back({triangle,
                           next_++,
                           static_cast<std::uint8_t>(level),
                           std::ldexp(1.0F, 2 * level)});
      }
    }
  }

  // Many points, each at its own level: a prefix of the sequence is as even as all of
  // it. What is left of a level shares the area of all its points, and something is.
  void SpreadInPlace(std::uint32_t triangle, std::int64_t count) {
    full_count_ += count;
    std::array<std::int64_t, kLitLevels> all{};
    std::array<std::int64_t, kLitLevels> kept{};
    const std::size_t first = places_.size();
    for (std::int64_t k = 0; k < count; ++k) {
      const auto index = static_cast<std::uint32_t>(k);
      const int level =
          seen_ == nullptr ? 0 : LevelAt(PlacePoint(shape_, triangle, index).position);
      const auto at_level = static_cast<std::size_t>(level);
      ++all[at_level];
      if (k << (2 * level) < count || all[at_level] == 1) {
        ++kept[at_level];
        places_.push_back({triangle, index, static_cast<std::uint8_t>(level), 0});
      }
    }
    for (std::size_t i = first; i < places_.size(); ++i) {
      const std::size_t level = places_[i].level;
      places_[i].parts = static_cast<float>(static_cast<double>(all[level]) /
                                            static_cast<double>(kept[level]));
    }
  }

  int LevelAt(Vec3 position) const {
    if (seen_ == nullptr) {
      return 0;
    }
    float limit = 2 * dense_;
    const float distance = seen_->DistanceTo(position);
    int level = 0;
    while (level + 1 < kLitLevels && distance >= limit) {
      ++level;
      limit *= 2;
    }
    return level;
  }

  const Shape& shape_;
  const SeenPlaces* seen_;
  float dense_;
  std::uint32_t next_ = 0;
  std::int64_t full_count_ = 0;
  std::vector<Place> places_;
};

struct Sharing {
  std::int64_t count;
  int thread_count;
  const Ranks* ranks;
};

// The light of each point, block by block of them on threads and ranks: every n-th
// block is this rank's, and all ranks get all.
void LightByBlocks(
    const Sharing& sharing,
    const std::function<Color(std::int64_t point, PathCounters& counters)>& light,
    LitPoints& result) {
  const int size = sharing.ranks == nullptr ? 1 : sharing.ranks->size();
  const int rank = sharing.ranks == nullptr ? 0 : sharing.ranks->rank();
  const std::int64_t blocks = (sharing.count + kBlock - 1) / kBlock;
  // Calls use(point) for all points of a rank's block number k.
  const auto for_block = [&](int of, std::int64_t k, const auto& use) {
    const std::int64_t begin = (k * size + of) * kBlock;
    for (std::int64_t i = begin; i < std::min(begin + kBlock, sharing.count); ++i) {
      use(i, result.points[static_cast<std::size_t>(i)].flux_density);
    }
  };
  const auto blocks_of = [&](int of) { return (blocks - of + size - 1) / size; };
  std::vector<PathCounters> counters(static_cast<std::size_t>(blocks_of(rank)));
  ParallelFor(blocks_of(rank), sharing.thread_count, [&](std::int64_t k) {
    PathCounters& of_block = counters[static_cast<std::size_t>(k)];
    for_block(rank, k, [&](std::int64_t i, Color& flux) { flux = light(i, of_block); });
  });
  for (const PathCounters& of_block : counters) {
    result.counters += of_block;
  }
  if (size == 1) {
    return;
  }
  std::vector<Color> mine;
  for (std::int64_t k = 0; k < blocks_of(rank); ++k) {
    for_block(rank, k, [&](std::int64_t, Color& flux) { mine.push_back(flux); });
  }
  const std::vector<std::string> all =
      sharing.ranks->AllGather(ToBytes(std::span<const Color>(mine)));
  for (int of = 0; of < size; ++of) {
    const auto theirs = FromBytes<Color>(all[static_cast<std::size_t>(of)]);
    std::size_t next = 0;
    for (std::int64_t k = 0; k < blocks_of(of); ++k) {
      for_block(of, k, [&](std::int64_t, Color& flux) { flux = theirs.at(next++); });
    }
  }
  std::int64_t rays[] = {result.counters.rays, result.counters.shadow_rays};
  sharing.ranks->Sum(rays);
  result.counters.rays = rays[0];
  result.counters.shadow_rays = rays[1];
}

}  // namespace

LitPoints SampleLitPoints(const World& world,
                          std::uint32_t shape_index,
                          const PathTracer& tracer,
                          const LitPointOptions& options) {
  const Shape& shape = world.scene().shapes[shape_index];
  const Translucency& translucency = *shape.translucency;
  const float patch_mm = translucency.model->PatchSizeMm();
  const double patch_area_mm2 = std::pow(static_cast<double>(patch_mm), 2);
  const double area_mm2 = AreaSampler(shape).area() *
                          std::pow(static_cast<double>(translucency.mm_per_unit), 2);

  LitPoints result;
  const double wanted =
      std::max(1.0, options.points_per_patch * area_mm2 / patch_area_mm2);
  result.capped = wanted > static_cast<double>(options.max_points);
  const double count = std::min(wanted, static_cast<double>(options.max_points));
  Placement placement(shape, options.seen, patch_mm / translucency.mm_per_unit);
  const std::vector<Place> places = placement.Spread(count);
  const auto place_count = std::ssize(places);
  result.skipped = std::max<std::int64_t>(0, placement.full_count() - place_count);
  result.area_mm2 = area_mm2;
  double parts = 0;
  for (const Place& place : places) {
    parts += static_cast<double>(place.parts);
  }

  const EnteringLight light(world,
                            tracer,
                            translucency.model->Eta(),
                            translucency.indirect && options.indirect);
  // The samples asked for are a patch's; its points share them. Where points are few,
  // each takes more of them.
  const int samples =
      std::max(1,
               static_cast<int>(std::lround(translucency.irradiance_samples /
                                            std::max(1.0, options.points_per_patch))));
  const std::uint64_t seed = MixSeed(options.seed, shape_index);
  result.points.resize(places.size());
  ParallelForBlocks(
      place_count,
      kBlock,
      options.thread_count,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t i = begin; i < end; ++i) {
          const Place& place = places[static_cast<std::size_t>(i)];
          LitPoint& lit = result.points[static_cast<std::size_t>(i)];
          lit.point = ToSurfacePoint(PlacePoint(shape, place.triangle, place.index),
                                     translucency.mm_per_unit);
          lit.area_mm2 =
              static_cast<float>(area_mm2 / parts * static_cast<double>(place.parts));
        }
      });
  LightByBlocks(
      {place_count, options.thread_count, options.ranks},
      [&](std::int64_t i, PathCounters& counters) {
        const Place& place = places[static_cast<std::size_t>(i)];
        return light.AllLights(PlacePoint(shape, place.triangle, place.index),
                               samples << place.level,
                               MixSeed(seed, static_cast<std::uint64_t>(i)),
                               counters);
      },
      result);
  return result;
}

}  // namespace nacre::render
