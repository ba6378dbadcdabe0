#pragma once

#include "render/camera.h"
#include "render/sampler.h"
#include "render/transform.h"
#include "render/vec.h"

#include <array>
#include <memory>
#include <vector>

namespace nacre::render {

/// Matter between surfaces that absorbs and scatters light, by Henyey & Greenstein's
/// phase function. Coefficients are a scene unit.
class ParticipatingMedium {
 public:
  explicit ParticipatingMedium(float g) : g_(g) {}
  virtual ~ParticipatingMedium() = default;

  /// Where a ray meets the medium next.
  struct Step {
    bool scattered = false;  ///< else it got to `distance` asked for
    float distance = 0;
    Color weight{1, 1, 1};  ///< transmittance (times σ_s, if scattered) over density
  };
  /// Along `ray`, up to `distance` (may be infinite). `throughput` is the path's, which
  /// chooses among the channels' free paths.
  virtual Step SampleStep(const Ray& ray,
                          float distance,
                          Color throughput,
                          Sampler& sampler) const = 0;

  /// An unbiased estimate of exp(−∫ σ_t) over `distance`.
  virtual Color Transmittance(const Ray& ray,
                              float distance,
                              Sampler& sampler) const = 0;

  /// Mean cosine of scattering.
  float g() const { return g_; }

 private:
  float g_;
};
using MediumPtr = std::shared_ptr<const ParticipatingMedium>;

/// The same everywhere.
MediumPtr MakeHomogeneousMedium(Color sigma_a, Color sigma_s, float g);

/// Values at the nodes of a grid: x fastest, then y, then z; `channels` 1 or 3.
struct VolumeGrid {
  std::array<int, 3> nodes{1, 1, 1};
  int channels = 1;
  Vec3 low{0, 0, 0};  ///< corners of the box that the nodes fill, in its own space
  Vec3 high{1, 1, 1};
  std::vector<float> values{1};
};

struct GridMediumParameters {
  VolumeGrid density;      ///< one channel; outside of its box there is nothing
  VolumeGrid albedo;       ///< in [0, 1]
  Color sigma_t{1, 1, 1};  ///< where the density is 1
  Transform world_from_grid;
  float g = 0;
};
/// By null collisions [Woodcock65], weighted by channel.
MediumPtr MakeGridMedium(const GridMediumParameters& parameters);

/// Henyey & Greenstein's density a steradian, of the cosine between the ways before and
/// after.
float PhasePdf(float g, float cosine);
/// A direction by that density, for light on its way along `forward`.
Vec3 SamplePhase(float g, Vec3 forward, Vec2 u);

}  // namespace nacre::render
