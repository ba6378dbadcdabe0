#include "rigs/transport/monte_carlo/symmetry.h"

#include "rigs/transport/monte_carlo/tally.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace nacre::rigs::monte_carlo {
namespace {

bool IsWhole(double x) {
  return std::abs(x - std::round(x)) < 1e-9;
}
bool IsOdd(double whole) {
  return std::lround(whole) % 2 != 0;
}

// Mirroring a line of alternating cells about a point maps cells to cells if the point
// is an edge, which exchanges the media, or a middle, which doesn't.
bool MapsPattern(const Motion& motion, const Pattern& pattern, PointMm centre) {
  if (pattern.type == PatternType::kHomogeneous) {
    return true;
  }
  if (pattern.type == PatternType::kMixture) {
    return !motion.exchange && !motion.mirror_x && !motion.mirror_y;
  }
  const double half_cells_x = 2 * centre.x / pattern.cell_mm;
  const double half_cells_y = 2 * centre.y / pattern.cell_mm;
  if (motion.mirror_x && !IsWhole(half_cells_x)) {
    return false;
  }
  bool exchanges_media = motion.mirror_x && !IsOdd(half_cells_x);
  if (pattern.type == PatternType::kStripes) {
    return !motion.exchange && !exchanges_media;
  }
  if (motion.mirror_y) {
    if (!IsWhole(half_cells_y)) {
      return false;
    }
    exchanges_media = exchanges_media != !IsOdd(half_cells_y);
  }
  // An exchange moves k cells along x and −k along y: an even number together.
  return !exchanges_media &&
         (!motion.exchange || IsWhole((centre.x - centre.y) / pattern.cell_mm));
}

bool MapsBox(const Motion& motion, const Box& box, PointMm centre) {
  if ((motion.mirror_x && centre.x != 0) || (motion.mirror_y && centre.y != 0)) {
    return false;
  }
  return !motion.exchange || (box.half_x_mm == box.half_y_mm && centre.x == centre.y);
}

bool MapsBeam(const Motion& motion, const Source& source) {
  return source.diffuse || source.angle_rad == 0 ||
         (!motion.exchange && !motion.mirror_x);
}

}  // namespace

std::vector<Motion> Symmetries(const Volume& volume, const Source& source) {
  std::vector<Motion> motions;
  for (int bits = 0; bits < 8; ++bits) {
    const Motion motion{(bits & 1) != 0, (bits & 2) != 0, (bits & 4) != 0};
    const bool maps_volume =
        (bits == 0 || !source.footprint) &&
        MapsPattern(motion, volume.pattern, source.centre) &&
        (!volume.box || MapsBox(motion, *volume.box, source.centre)) &&
        (!volume.voxels || bits == 0);
    if (maps_volume && MapsBeam(motion, source)) {
      motions.push_back(motion);
    }
  }
  return motions;
}

void AverageImages(const std::vector<Motion>& motions,
                   const TallyRequest& request,
                   Result& result) {
  const int last = request.window_core - 1;
  const double cell_mm2 = request.window_pitch_mm * request.window_pitch_mm;
  const std::vector<Estimate> window = result.window_per_mm2;
  const auto cell_of = [&](int u, int v) {
    return static_cast<std::size_t>(v) * static_cast<std::size_t>(last + 1) +
           static_cast<std::size_t>(u);
  };
  std::vector<std::size_t> images;
  for (int v = 0; v <= last; ++v) {
    for (int u = 0; u <= last; ++u) {
      images.clear();
      for (const Motion& motion : motions) {
        // Rows run downwards: exchanging x and y is (u, v) to (last − v, last − u).
        const int x = motion.exchange ? last - v : u;
        const int y = motion.exchange ? last - u : v;
        images.push_back(
            cell_of(motion.mirror_x ? last - x : x, motion.mirror_y ? last - y : y));
      }
      std::sort(images.begin(), images.end());
      images.erase(std::unique(images.begin(), images.end()), images.end());
      double sum = 0;
      for (const std::size_t image : images) {
        sum += window[image].mean * cell_mm2;
      }
      const Estimate together = BinomialEstimate(sum, result.photon_count);
      const double share = 1 / (static_cast<double>(images.size()) * cell_mm2);
      result.window_per_mm2[cell_of(u, v)] = {together.mean * share,
                                              together.se * share};
    }
  }
}

}  // namespace nacre::rigs::monte_carlo
