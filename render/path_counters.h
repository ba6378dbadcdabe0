#pragma once

#include <cstdint>

namespace nacre::render {

/// What paths did; each thread counts for itself.
struct PathCounters {
  std::int64_t rays = 0;
  std::int64_t shadow_rays = 0;
  std::int64_t exitances = 0;    ///< hits of translucent surfaces
  std::int64_t evaluations = 0;  ///< questions to models of translucency
  std::int64_t pairs = 0;        ///< sources, patches or clusters, that these asked
  std::int64_t probes = 0;       ///< lines that looked for places of entry (reference)
  std::int64_t probes_cut = 0;   ///< of them, stopped after too many surfaces

  PathCounters& operator+=(const PathCounters& other) {
    rays += other.rays;
    shadow_rays += other.shadow_rays;
    exitances += other.exitances;
    evaluations += other.evaluations;
    pairs += other.pairs;
    probes += other.probes;
    probes_cut += other.probes_cut;
    return *this;
  }
};

}  // namespace nacre::render
