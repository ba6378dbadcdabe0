#include "render/tile_pass.h"

#include "core/error.h"
#include "render/camera.h"
#include "render/sampler.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace nacre::render {
namespace {

struct TileRequest {
  std::int64_t tile = 0;
  std::int64_t up_to = 0;
};

template <class T>
std::string RawBytes(const T& value) {
  return {reinterpret_cast<const char*>(&value), sizeof(value)};
}

template <class T>
T TakeRaw(std::string_view& bytes) {
  T value;
  Expect(bytes.size() >= sizeof(value), "a whole description of a tile");
  std::memcpy(&value, bytes.data(), sizeof(value));
  bytes.remove_prefix(sizeof(value));
  return value;
}

}  // namespace

TileCounters& TileCounters::operator+=(const TileCounters& other) {
  paths += other.paths;
  samples += other.samples;
  bad += other.bad;
  clamped += other.clamped;
  return *this;
}

TilePass::TilePass(const Scene& scene,
                   const PathTracer& tracer,
                   const SampleSettings& settings,
                   const SamplePlan& plan,
                   Accumulator& film)
    : film_(scene.film),
      camera_(scene.camera),
      tracer_(tracer),
      settings_(settings),
      plan_(plan),
      filter_(scene.film),
      accumulator_(film) {}

PixelBlock TilePass::BlockOf(std::int64_t tile) const {
  constexpr int kTile = SamplePlan::kTile;
  const int x0 = static_cast<int>(tile % plan_.tiles_x()) * kTile;
  const int y0 = static_cast<int>(tile / plan_.tiles_x()) * kTile;
  return {x0,
          y0,
          std::min(x0 + kTile, film_.crop_width),
          std::min(y0 + kTile, film_.crop_height)};
}

std::size_t TilePass::PixelAt(int x, int y) const {
  return static_cast<std::size_t>(y) * static_cast<std::size_t>(film_.crop_width) +
         static_cast<std::size_t>(x);
}

TileCounters TilePass::Trace(std::int64_t tile, int up_to) {
  TileCounters counters;
  const PixelBlock block = BlockOf(tile);
  for (int y = block.y0; y < block.y1; ++y) {
    for (int x = block.x0; x < block.x1; ++x) {
      const auto done = static_cast<int>(accumulator_.SamplesMade(PixelAt(x, y)));
      for (int sample = done; sample < up_to; ++sample) {
        AddSample(x, y, sample, counters);
      }
      counters.samples += std::max(0, up_to - done);
    }
  }
  return counters;
}

void TilePass::AddSample(int x, int y, int sample, TileCounters& counters) {
  // Named by the place on the full film: a crop shows the same noise.
  const int film_x = film_.crop_x + x;
  const int film_y = film_.crop_y + y;
  const std::uint64_t pixel_seed = MixSeed(
      settings_.seed,
      static_cast<std::uint64_t>(film_y) * static_cast<std::uint64_t>(film_.width) +
          static_cast<std::uint64_t>(film_x));
  Sampler sampler(pixel_seed, static_cast<std::uint32_t>(sample));
  const FilterSampler::Sample filter = filter_(sampler.Next2D());
  const Vec2 position{static_cast<float>(film_x) + 0.5F + filter.offset.x,
                      static_cast<float>(film_y) + 0.5F + filter.offset.y};
  const Ray ray = CameraRay(camera_, position, film_.width, film_.height);
  PathTracer::Result result = tracer_.Radiance(ray, sampler, counters.paths);
  const float brightest = MaxComponent(result.radiance);
  const float bound = static_cast<float>(settings_.clamp);
  if (bound > 0 && brightest > bound && std::isfinite(brightest)) {
    result.radiance *= bound / brightest;
    ++counters.clamped;
  }
  if (!accumulator_.Add(PixelAt(x, y), result.radiance, result.alpha, filter.weight)) {
    ++counters.bad;
  }
}

// Pixels are traced in order.
bool TilePass::IsDone(std::int64_t tile, int up_to) const {
  const PixelBlock block = BlockOf(tile);
  return accumulator_.SamplesMade(PixelAt(block.x1 - 1, block.y1 - 1)) >= up_to;
}

std::string TilePass::Describe(std::int64_t tile, int up_to) const {
  return RawBytes(TileRequest{tile, up_to}) + accumulator_.Bytes(BlockOf(tile));
}

std::string TilePass::TraceDescribed(std::string_view description) {
  const auto request = TakeRaw<TileRequest>(description);
  const PixelBlock block = BlockOf(request.tile);
  Expect(accumulator_.Restore(block, description), "the sums of a tile");
  const TileCounters counters = Trace(request.tile, static_cast<int>(request.up_to));
  return RawBytes(counters) + accumulator_.Bytes(block);
}

TileCounters TilePass::TakeResult(std::int64_t tile, std::string_view result) {
  const auto counters = TakeRaw<TileCounters>(result);
  Expect(accumulator_.Restore(BlockOf(tile), result), "the sums of a tile");
  return counters;
}

}  // namespace nacre::render
