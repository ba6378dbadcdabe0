#pragma once

#include "render/integrators/path.h"
#include "render/invariants.h"
#include "render/render.h"
#include "render/seen_places.h"
#include "render/world.h"

#include <memory>
#include <vector>

namespace nacre::render {

/// The translucent shapes of a scene with their light, for a path tracer: gathered from
/// lit points, or sampled (integrator "reference").
class Exitances {
 public:
  /// Does all that has to be done before paths: finds what is seen, lets light in,
  /// prepares the models. Times and counts go into `summary`. References must outlive
  /// it.
  Exitances(const World& world,
            const IntegratorSettings& settings,
            const RenderOptions& options,
            const ProgressFunction& progress,
            RenderSummary& summary);

  const ExitanceSources& sources() const { return sources_; }

  /// What has been used of all models.
  void AddUse(ModelUse& use) const;

  /// Light in and out of each shape that has the lit points its model asks for.
  std::vector<ObjectEnergy> Energies(int thread_count) const {
    return energy_.Measure(thread_count);
  }

 private:
  void FindSeen(const RenderOptions& options);
  void Illuminate(std::uint32_t shape,
                  const RenderOptions& options,
                  std::int64_t shape_count,
                  RenderSummary& summary);

  const World& world_;
  IntegratorSettings settings_;
  ExitanceSources none_;  ///< a null for each shape
  PathTracer indirect_;   ///< to which translucent shapes are dark
  std::vector<std::unique_ptr<SeenPlaces>> seen_;
  std::vector<std::unique_ptr<const ExitanceSource>> owned_;
  ExitanceSources sources_;
  EnergyCheck energy_;
};

}  // namespace nacre::render
