#include "render/integrators/photon_map.h"

#include "render/warp.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace nacre::render {
namespace {

// What lies on a surface that faces another way isn't of this one.
constexpr float kSameFacing = 0.7F;

}  // namespace

PhotonMap::PhotonMap(std::vector<Photon> photons, float radius)
    : radius_(radius),
      per_cell_(0.5F / radius),
      mask_(std::bit_ceil(std::max<std::size_t>(photons.size(), 1)) - 1),
      photons_(photons.size()),
      begin_(mask_ + 2) {
  std::vector<std::size_t> buckets(photons.size());
  for (std::size_t i = 0; i < photons.size(); ++i) {
    buckets[i] = Bucket(CellOf(photons[i].position));
    ++begin_[buckets[i] + 1];
  }
  for (std::size_t b = 1; b < begin_.size(); ++b) {
    begin_[b] += begin_[b - 1];
  }
  std::vector<std::uint32_t> next(begin_.begin(), begin_.end() - 1);
  for (std::size_t i = 0; i < photons.size(); ++i) {
    photons_[next[buckets[i]]++] = photons[i];
  }
}

PhotonMap::Cell PhotonMap::CellOf(Vec3 position) const {
  const auto along = [&](float x) {
    // What is too far for a number of a cell shares the last one.
    constexpr float kMost = 1e9F;
    return static_cast<std::int32_t>(
        std::clamp(std::floor(x * per_cell_), -kMost, kMost));
  };
  return {along(position.x), along(position.y), along(position.z)};
}

std::size_t PhotonMap::Bucket(const Cell& cell) const {
  // Three large primes [Teschner03].
  const auto mix = static_cast<std::uint64_t>(cell.x) * 73856093u ^
                   static_cast<std::uint64_t>(cell.y) * 19349663u ^
                   static_cast<std::uint64_t>(cell.z) * 83492791u;
  return (mix ^ (mix >> 17)) & mask_;
}

Color PhotonMap::Radiance(const SurfaceHit& hit,
                          const Frame& frame,
                          Vec3 wo,
                          int max_edges) const {
  if (photons_.empty()) {
    return {};
  }
  // A cell is two radii wide: eight of them cover the ball.
  const Vec3 r{radius_, radius_, radius_};
  const Cell low = CellOf(hit.position - r);
  Color sum;
  for (int n = 0; n < 8; ++n) {
    const Cell cell{low.x + (n & 1), low.y + (n >> 1 & 1), low.z + (n >> 2 & 1)};
    const std::size_t bucket = Bucket(cell);
    for (std::size_t i = begin_[bucket]; i < begin_[bucket + 1]; ++i) {
      const Photon& photon = photons_[i];
      const Vec3 d = photon.position - hit.position;
      if (Dot(d, d) >= radius_ * radius_ || !(CellOf(photon.position) == cell) ||
          Dot(photon.normal, frame.n) < kSameFacing ||
          (max_edges >= 0 && photon.edges > max_edges)) {
        continue;
      }
      const Vec3 wi = frame.ToLocal(photon.wi);
      if (wi.z * Dot(hit.face_normal, photon.wi) <= 0) {
        continue;
      }
      const BsdfValue bsdf = hit.shape->bsdf->Evaluate(wo, wi, hit.uv);
      sum += bsdf.value * photon.flux_w / std::abs(wi.z);
    }
  }
  return sum / (kPi * radius_ * radius_);
}

}  // namespace nacre::render
