#include "core/error.h"
#include "render/subsurface/material_windows.h"
#include "render/subsurface/models.h"
#include "render/subsurface/patch_tree.h"

#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace nacre::render {
namespace {

/// Nearer than this many pitches, a patch is four sources instead of one: R_d changes
/// over its own extent.
constexpr float kNearPitches = 2;

Vec2 operator+(Vec2 a, Vec2 b) {
  return {a.x + b.x, a.y + b.y};
}
Vec2 operator-(Vec2 a, Vec2 b) {
  return {a.x - b.x, a.y - b.y};
}

class FactoredGather final : public Subsurface {
 public:
  FactoredGather(std::shared_ptr<const MaterialWindows> windows,
                 std::vector<Patch> patches,
                 const FactoredOptions& options)
      : windows_(std::move(windows)),
        tree_(std::move(patches)),
        per_mm_(1 / windows_->pitch_mm()),
        reach_mm_(std::numbers::sqrt2_v<float> * windows_->radius() *
                  windows_->pitch_mm()),
        max_relative_extent_(static_cast<float>(options.max_relative_extent)) {
    for (const Patch& patch : tree_.patches()) {
      patches_.push_back(SourceOf(patch));
    }
    for (const PatchTree::Node& node : tree_.nodes()) {
      node_flux_w_.push_back(ToLanes(FluxThroughBrightest(node)));
    }
  }

  Color Exitance(const SurfacePoint& x_o) const override {
    ColorLanes sum;
    const float near_mm = kNearPitches * windows_->pitch_mm();
    const auto add_patch = [&](std::int32_t index, Vec3 d_mm) {
      const auto i = static_cast<std::size_t>(index);
      const Source& source = patches_[i];
      const Offset d = Project(d_mm, source);
      if (d.squared > kNearPitches * kNearPitches) {
        sum += Lookup(source, d.plane, d.squared) * source.flux_w;
      } else {
        sum += LookupExtended(source, d, source.extent_a, source.extent_b) *
               (source.flux_w * 0.25F);
      }
    };
    const auto add_node = [&](std::int32_t index, Vec3 d_mm) {
      const auto i = static_cast<std::size_t>(index);
      const PatchTree::Node& node = tree_.nodes()[i];
      if (Dot(d_mm, d_mm) < near_mm * near_mm) {
        for (std::int32_t p = node.begin; p < node.end; ++p) {
          const Vec3 centre =
              tree_.patches()[static_cast<std::size_t>(p)].point.position_mm;
          add_patch(p, x_o.position_mm - centre);
        }
        return;
      }
      const Source& source = patches_[static_cast<std::size_t>(node.brightest)];
      const Offset d = Project(d_mm, source);
      const float spread = std::sqrt(node.variance_mm2) * per_mm_;
      sum += LookupExtended(source, d, {spread, 0}, {0, spread}) *
             (node_flux_w_[i] * 0.25F);
    };
    tree_.Visit(x_o.position_mm, max_relative_extent_, reach_mm_, add_node, add_patch);
    return {sum.v[0], sum.v[1], sum.v[2]};
  }

 private:
  /// A patch as this model sees it; lengths in pitches of the material.
  struct Source {
    ColorLanes flux_w;
    Vec3 column_axis;  ///< of the window, per mm: +u
    Vec3 row_axis;     ///< −v
    Vec2 extent_a;     ///< standard deviations of the patch, in columns and rows
    Vec2 extent_b;
    int window = 0;
  };
  /// From x_i to x_o, in pitches.
  struct Offset {
    Vec2 plane;         ///< columns and rows
    float squared = 0;  ///< distance in space, squared
  };

  Source SourceOf(const Patch& patch) const {
    Source source;
    source.flux_w = ToLanes(patch.flux_w);
    source.column_axis = patch.point.tangent_u * per_mm_;
    source.row_axis = -(patch.point.tangent_v * per_mm_);
    const auto in_plane = [&](Vec3 v) {
      return Vec2{Dot(v, source.column_axis), Dot(v, source.row_axis)};
    };
    source.extent_a = in_plane(patch.axis_a_mm);
    source.extent_b = in_plane(patch.axis_b_mm);
    source.window = windows_->WindowAt(patch.point.uv);
    return source;
  }

  /// The flux that has to enter at the brightest patch of a node for what leaves to be
  /// what its patches' albedos say.
  Color FluxThroughBrightest(const PatchTree::Node& node) const {
    const Color albedo =
        windows_->Albedo(patches_[static_cast<std::size_t>(node.brightest)].window);
    Color leaving;
    for (std::int32_t p = node.begin; p < node.end; ++p) {
      const auto i = static_cast<std::size_t>(p);
      leaving += tree_.patches()[i].flux_w * windows_->Albedo(patches_[i].window);
    }
    const auto through = [](float out, float a, float plain) {
      return a > 0 ? out / a : plain;
    };
    return {through(leaving.x, albedo.x, node.flux_w.x),
            through(leaving.y, albedo.y, node.flux_w.y),
            through(leaving.z, albedo.z, node.flux_w.z)};
  }

  Offset Project(Vec3 d_mm, const Source& source) const {
    return {{Dot(d_mm, source.column_axis), Dot(d_mm, source.row_axis)},
            Dot(d_mm, d_mm) * per_mm_ * per_mm_};
  }

  /// R_d at an offset turned into the tangent plane: its direction there, its full
  /// length.
  ColorLanes Lookup(const Source& source, Vec2 plane, float squared) const {
    const float in_plane = plane.x * plane.x + plane.y * plane.y;
    if (in_plane > 1e-8F * squared) {
      const float stretch = std::sqrt(squared / in_plane);
      return windows_->At(source.window, plane.x * stretch, plane.y * stretch);
    }
    // Straight through: any direction is as good as another.
    return windows_->At(source.window, std::sqrt(squared), 0);
  }

  /// Four times the mean over a patch of which `a` and `b` are the standard deviations
  /// along its axes, by the product of two two-point Gauss rules.
  ColorLanes LookupExtended(const Source& source,
                            const Offset& d,
                            Vec2 a,
                            Vec2 b) const {
    const float outside =
        std::max(0.0F, d.squared - d.plane.x * d.plane.x - d.plane.y * d.plane.y);
    const Vec2 sum = a + b;
    const Vec2 difference = a - b;
    ColorLanes total;
    for (const Vec2 p :
         {d.plane + sum, d.plane - sum, d.plane + difference, d.plane - difference}) {
      total += Lookup(source, p, p.x * p.x + p.y * p.y + outside);
    }
    return total;
  }

  std::shared_ptr<const MaterialWindows> windows_;
  PatchTree tree_;
  std::vector<Source> patches_;
  std::vector<ColorLanes> node_flux_w_;
  float per_mm_;
  float reach_mm_;
  float max_relative_extent_;
};

class Factored final : public SubsurfaceModel {
 public:
  Factored(std::shared_ptr<const factor::Material> material,
           const FactoredOptions& options)
      : windows_(std::make_shared<MaterialWindows>(material, options.window_cache_mb)),
        eta_(static_cast<float>(material->eta)),
        options_(options) {}

  float Eta() const override { return eta_; }
  float PatchSizeMm() const override {
    return windows_->pitch_mm() / static_cast<float>(options_.patches_per_pitch);
  }
  std::unique_ptr<Subsurface> Illuminate(std::vector<LitPoint> lit,
                                         int /*thread_count*/) const override {
    return std::make_unique<FactoredGather>(
        windows_, GatherPatches(lit, PatchSizeMm()), options_);
  }

 private:
  std::shared_ptr<const MaterialWindows> windows_;
  float eta_;
  FactoredOptions options_;
};

}  // namespace

std::shared_ptr<const SubsurfaceModel> MakeFactored(
    std::shared_ptr<const factor::Material> material, const FactoredOptions& options) {
  Expect(material != nullptr, "a factored subsurface model needs a material");
  Validate(options);
  factor::Validate(*material, "subsurface");
  return std::make_shared<Factored>(std::move(material), options);
}

}  // namespace nacre::render
