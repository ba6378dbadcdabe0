#pragma once

#include "core/options.h"
#include "factor/material.h"
#include "render/subsurface/material_mapping.h"
#include "render/subsurface/subsurface.h"
#include "render/subsurface/window_source.h"

#include <memory>

namespace nacre::render {

/// A homogeneous medium under the dipole model [Jensen01], a value a channel (R, G, B).
struct DipoleParameters {
  Color sigma_a_per_mm;
  Color sigma_s_prime_per_mm;  ///< σ_s (1 − g)
  float eta = 1.5F;            ///< refractive index inside / outside
};

/// How finely light is gathered; the defaults are good to about 1 %.
struct DipoleOptions {
  /// A cluster of patches counts as one source if its diameter is below this fraction
  /// of its distance. 0 gathers every patch.
  double max_relative_extent = 0.5;
  /// A cluster also counts as one source if the error of that is below this fraction of
  /// what is gathered.
  double negligible = 2e-4;
  /// Side of the patches in transport mean free paths of the most scattering channel.
  double patch_mean_free_paths = 0.8;

  template <class Self, class Visitor>
  static void Visit(Self& self, Visitor&& visit) {
    visit("max_relative_extent",
          self.max_relative_extent,
          Range{0, 1},
          "cluster diameter / distance below which a cluster is one source");
    visit("negligible",
          self.negligible,
          Range{0, 1},
          "error of a cluster, of all that is gathered, below which it is one source");
    visit("patch_mean_free_paths",
          self.patch_mean_free_paths,
          Range{0.05, 8},
          "side of the patches in transport mean free paths");
  }
};

/// Throws a usage Error for coefficients that are negative, not finite or all zero, or
/// eta < 1.
std::shared_ptr<const SubsurfaceModel> MakeDipole(const DipoleParameters& parameters,
                                                  const DipoleOptions& options = {});

struct FactoredOptions {
  double patches_per_pitch = 2;  ///< patch side = pitch / this
  /// As for the dipole; clusters are used from a few pitches on.
  double max_relative_extent = 0.6;
  double window_cache_mb = 256;  ///< for evaluated windows, at most

  template <class Self, class Visitor>
  static void Visit(Self& self, Visitor&& visit) {
    visit("patches_per_pitch",
          self.patches_per_pitch,
          Range{0.5, 8},
          "patches along one pitch of the material");
    visit("max_relative_extent",
          self.max_relative_extent,
          Range{0, 1},
          "cluster diameter / distance below which a cluster is one source");
    visit("window_cache_mb",
          self.window_cache_mb,
          Range{0, 65536},
          "memory for evaluated windows; those beyond it cost time");
  }
};

/// How the sample lies on the surface.
struct SampleOnSurface {
  Mapping mapping = Mapping::kWorld;
  SamplePose pose{};
};

/// R_d as measured, from wherever. One channel serves all three colours, three serve
/// R, G, B in order; BadData for any other number.
std::shared_ptr<const SubsurfaceModel> MakeMeasured(
    const std::shared_ptr<const WindowSource>& source,
    const FactoredOptions& options = {},
    const SampleOnSurface& mapping = {});

/// A measured, factored material (`<subsurface type="svd">`). One channel serves all
/// three colours, three serve R, G, B in order; BadData for any other number.
std::shared_ptr<const SubsurfaceModel> MakeFactored(
    std::shared_ptr<const factor::Material> material,
    const FactoredOptions& options = {},
    const SampleOnSurface& mapping = {});

}  // namespace nacre::render
