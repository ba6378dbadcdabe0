#include "core/error.h"
#include "core/fresnel.h"
#include "render/subsurface/dipole_profile.h"
#include "render/subsurface/dipole_table.h"
#include "render/subsurface/patch_tree.h"
#include "render/subsurface/radial_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <numbers>

namespace nacre::render {
namespace {

class DipoleGather final : public Subsurface {
 public:
  DipoleGather(const ProfileTriple& profiles,
               std::vector<Patch> patches,
               const DipoleOptions& options,
               int thread_count)
      : table_(profiles, LargestDisc(patches), thread_count),
        tree_(std::move(patches)),
        max_relative_extent_(static_cast<float>(options.max_relative_extent)),
        negligible_(static_cast<float>(options.negligible)) {
    for (const Patch& patch : tree_.patches()) {
      patches_.push_back({ToLanes(patch.flux_w), patch.point.normal, Disc2(patch)});
    }
    for (const PatchTree::Node& node : tree_.nodes()) {
      nodes_.push_back({ToLanes(node.flux_w), node.normal, node.variance_mm2});
    }
  }

  Color Gather(const SurfacePoint& x_o, std::int64_t& pairs) const override {
    ColorLanes sum;
    std::int64_t asked = 0;
    const auto is_small = tree_.SmallerThan(max_relative_extent_);
    const float little = negligible_ * AtLeast(x_o.position_mm);
    tree_.Visit(
        x_o.position_mm,
        table_.reach_mm(),
        [&](std::int32_t node, float distance2) {
          return is_small(node, distance2) || IsLittle(node, distance2, little);
        },
        [&](std::int32_t node, Vec3 d_mm) {
          const Source& source = nodes_[static_cast<std::size_t>(node)];
          ++asked;
          table_.AddFar(
              DistanceOf(d_mm, source), source.extent_mm2, source.flux_w, sum);
        },
        [&](std::int32_t patch, Vec3 d_mm) {
          const Source& source = patches_[static_cast<std::size_t>(patch)];
          ++asked;
          table_.AddDisc(
              DistanceOf(d_mm, source), source.extent_mm2, source.flux_w, sum);
        });
    pairs += asked;
    return {sum.v[0], sum.v[1], sum.v[2]};
  }

 private:
  struct Source {
    ColorLanes flux_w;
    Vec3 normal;
    float extent_mm2;  ///< squared radius of a patch, variance of a node
  };

  static float Total(const ColorLanes& flux_w) {
    return flux_w.v[0] + flux_w.v[1] + flux_w.v[2];
  }

  /// A lower bound of what is gathered at x (of a sum over channels): of some node
  /// around it, all flux, carried to the farthest of its patches.
  float AtLeast(Vec3 x_mm) const {
    float bound = 0;
    tree_.Descend(x_mm, [&](std::int32_t n) {
      const PatchTree::Node& node = tree_.nodes()[static_cast<std::size_t>(n)];
      const float farthest = Length(x_mm - node.centre_mm) + node.radius_mm;
      bound = std::max(bound,
                       table_.AtLeast(farthest * farthest) *
                           Total(nodes_[static_cast<std::size_t>(n)].flux_w));
    });
    return bound;
  }

  /// Whether the error of taking a node as one source, of second order in its extent
  /// over its distance, is below `little`.
  bool IsLittle(std::int32_t n, float distance2, float little) const {
    const float radius = tree_.nodes()[static_cast<std::size_t>(n)].radius_mm;
    constexpr float kNear2 = 2;  // below √2 radii away, nothing is
    if (radius * radius * kNear2 > distance2) {
      return false;
    }
    const float nearest = std::sqrt(distance2) - radius;
    return Total(nodes_[static_cast<std::size_t>(n)].flux_w) *
               table_.AtMost(nearest * nearest) * radius * radius <
           little * distance2;
  }

  static DipoleTable::Distance DistanceOf(Vec3 d_mm, const Source& source) {
    const float squared = Dot(d_mm, d_mm);
    const float out_of_plane = Dot(d_mm, source.normal);
    return {squared, squared - out_of_plane * out_of_plane};
  }
  static float Disc2(const Patch& patch) {
    return patch.area_mm2 / std::numbers::pi_v<float>;
  }
  static double LargestDisc(const std::vector<Patch>& patches) {
    float largest = 0;
    for (const Patch& patch : patches) {
      largest = std::max(largest, Disc2(patch));
    }
    return std::sqrt(static_cast<double>(largest));
  }

  DipoleTable table_;
  PatchTree tree_;
  std::vector<Source> patches_;
  std::vector<Source> nodes_;
  float max_relative_extent_;
  float negligible_;
};

class Dipole final : public SubsurfaceModel {
 public:
  Dipole(const ProfileTriple& profiles,
         float eta,
         float patch_mm,
         const DipoleOptions& options)
      : profiles_(profiles), eta_(eta), patch_mm_(patch_mm), options_(options) {}

  float Eta() const override { return eta_; }
  float PatchSizeMm() const override { return patch_mm_; }
  Color Rd(const SurfacePoint& x_i, const SurfacePoint& x_o) const override {
    const auto r = static_cast<double>(Length(x_o.position_mm - x_i.position_mm));
    return {static_cast<float>(profiles_[0]->Rd(r)),
            static_cast<float>(profiles_[1]->Rd(r)),
            static_cast<float>(profiles_[2]->Rd(r))};
  }
  RadialDensity Spread() const override {
    double finest = std::numeric_limits<double>::infinity();
    double reach = 0;
    for (const auto& p : profiles_) {
      finest = std::min(finest, p->MeanFreePathMm() / 64);
      reach = std::max(reach, ReachMm(*p));
    }
    return RadialDensity(
        [&](double r) {
          return profiles_[0]->Rd(r) + profiles_[1]->Rd(r) + profiles_[2]->Rd(r);
        },
        finest,
        reach);
  }
  std::unique_ptr<Subsurface> Illuminate(std::vector<LitPoint> lit,
                                         int thread_count) const override {
    return std::make_unique<DipoleGather>(
        profiles_,
        GatherPatches(lit, patch_mm_, {}, thread_count),
        options_,
        thread_count);
  }

 private:
  ProfileTriple profiles_;
  float eta_;
  float patch_mm_;
  DipoleOptions options_;
};

}  // namespace

std::shared_ptr<const SubsurfaceModel> MakeRadial(const ProfileTriple& profiles,
                                                  float eta,
                                                  const DipoleOptions& options) {
  Validate(options);
  if (!(eta >= 1 && std::isfinite(eta))) {
    throw UsageError(
        fmt::format("a dipole with refractive index {}: at least 1 is "
                    "needed (inside relative to outside)",
                    eta));
  }
  double mean_free_path_mm = std::numeric_limits<double>::infinity();
  for (const auto& p : profiles) {
    if (p->Total() > 0) {
      mean_free_path_mm = std::min(mean_free_path_mm, p->MeanFreePathMm());
    }
  }
  if (!std::isfinite(mean_free_path_mm)) {
    throw UsageError("a dipole that scatters in no channel: sigma_s' is 0 in all");
  }
  return std::make_shared<Dipole>(
      profiles,
      eta,
      static_cast<float>(options.patch_mean_free_paths * mean_free_path_mm),
      options);
}

std::shared_ptr<const SubsurfaceModel> MakeDipole(const DipoleParameters& parameters,
                                                  const DipoleOptions& options) {
  const double internal_reflectance =
      parameters.eta >= 1 && std::isfinite(parameters.eta)  // else refused below
          ? DiffuseFresnelReflectance(1 / static_cast<double>(parameters.eta))
          : 0;
  const auto profile = [&](int c) {
    return std::make_shared<DipoleProfile>(
        static_cast<double>(parameters.sigma_a_per_mm[c]),
        static_cast<double>(parameters.sigma_s_prime_per_mm[c]),
        internal_reflectance);
  };
  return MakeRadial({profile(0), profile(1), profile(2)}, parameters.eta, options);
}

}  // namespace nacre::render
