#include "render/subsurface/textured_model.h"

#include "core/error.h"
#include "render/subsurface/dipole_table.h"
#include "render/subsurface/patch_tree.h"
#include "render/subsurface/profile_shapes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <numbers>

namespace nacre::render {
namespace {

/// A cluster is one source if its diameter is below this fraction of its distance.
constexpr float kMaxRelativeExtent = 0.35F;

/// Where parameters are looked at to choose sizes.
constexpr int kPlaces = 64;

using Profile = std::shared_ptr<const RadialProfile>;

/// Calls visit(profile) for each channel at kPlaces² places over the texture. Profiles
/// that are the same one after the other are visited once.
template <class Visitor>
void ForEachProfile(const TexturedMedium& medium, int places, Visitor&& visit) {
  std::array<std::pair<float, float>, 3> before;
  before.fill({-1.0F, -1.0F});
  for (int n = 0; n < places * places; ++n) {
    const float side = static_cast<float>(places);
    const int column = n % places;
    const int row = n / places;
    const Vec2 uv{(static_cast<float>(column) + 0.5F) / side,
                  (static_cast<float>(row) + 0.5F) / side};
    const Color first = medium.first->At(uv);
    const Color second = medium.second->At(uv);
    for (int c = 0; c < 3; ++c) {
      const std::pair now{first[c], second[c]};
      if (now == before[static_cast<std::size_t>(c)]) {
        continue;
      }
      before[static_cast<std::size_t>(c)] = now;
      const Profile profile =
          medium.profile(static_cast<double>(first[c]), static_cast<double>(second[c]));
      if (profile != nullptr && profile->Total() > 0) {
        visit(*profile);
      }
    }
  }
}

class Total final : public Texture {
 public:
  Total(TexturedMedium medium, std::shared_ptr<const ProfileShapes> shapes)
      : medium_(std::move(medium)), shapes_(std::move(shapes)) {}
  Color At(Vec2 uv) const override {
    const Color first = medium_.first->At(uv);
    const Color second = medium_.second->At(uv);
    return {shapes_->Total(first.x, second.x),
            shapes_->Total(first.y, second.y),
            shapes_->Total(first.z, second.z)};
  }
  Color Mean() const override { return At({0.5F, 0.5F}); }
  Color Max() const override { return {1, 1, 1}; }

 private:
  TexturedMedium medium_;
  std::shared_ptr<const ProfileShapes> shapes_;
};

class TexturedGather final : public Subsurface {
 public:
  TexturedGather(TexturedMedium medium,
                 std::shared_ptr<const ProfileShapes> shapes,
                 std::vector<Patch> patches)
      : medium_(std::move(medium)),
        shapes_(std::move(shapes)),
        tree_(std::move(patches)) {}

  Color Gather(const SurfacePoint& x_o, std::int64_t& pairs) const override {
    const Color first = medium_.first->At(x_o.uv);
    const Color second = medium_.second->At(x_o.uv);
    std::array<double, 3> sum{};
    float reach_mm = 0;
    std::array<const ProfileShape*, 3> shape{};
    for (int c = 0; c < 3; ++c) {
      const ProfileShape* const found = shapes_->Find(first[c], second[c]);
      shape[static_cast<std::size_t>(c)] = found;
      reach_mm = found == nullptr ? reach_mm : std::max(reach_mm, found->reach_mm());
    }
    const auto add = [&](Color flux_w, float distance2) {
      ++pairs;
      for (std::size_t c = 0; c < 3; ++c) {
        if (shape[c] != nullptr) {
          sum[c] += static_cast<double>(flux_w[static_cast<int>(c)] *
                                        shape[c]->At(distance2));
        }
      }
    };
    tree_.Visit(
        x_o.position_mm,
        reach_mm,
        tree_.SmallerThan(kMaxRelativeExtent),
        [&](std::int32_t index, Vec3 d_mm) {
          const PatchTree::Node& node = tree_.nodes()[static_cast<std::size_t>(index)];
          add(node.flux_w, Nearer(d_mm, node));
        },
        [&](std::int32_t index, Vec3 d_mm) {
          add(tree_.patches()[static_cast<std::size_t>(index)].flux_w, Dot(d_mm, d_mm));
        });
    return {static_cast<float>(sum[0]),
            static_cast<float>(sum[1]),
            static_cast<float>(sum[2])};
  }

 private:
  /// The squared distance at which a point brings what a cluster does, for R_d ~ r⁻³:
  /// as in factored_gather.cc.
  static float Nearer(Vec3 d_mm, const PatchTree::Node& node) {
    const float squared = Dot(d_mm, d_mm);
    const float out = Dot(d_mm, node.normal);
    const float in_plane = std::max(0.0F, squared - out * out) / squared;
    const float nearer = 1 - 0.5F * node.variance_mm2 / squared * (5 * in_plane - 2);
    return squared * nearer * nearer;
  }

  TexturedMedium medium_;
  std::shared_ptr<const ProfileShapes> shapes_;
  PatchTree tree_;
};

class TexturedModel final : public SubsurfaceModel {
 public:
  TexturedModel(TexturedMedium medium,
                float patch_mm,
                std::shared_ptr<const ProfileShapes> shapes)
      : medium_(std::move(medium)), patch_mm_(patch_mm), shapes_(std::move(shapes)) {}

  float Eta() const override { return medium_.eta; }
  float PatchSizeMm() const override { return patch_mm_; }

  Color Rd(const SurfacePoint& x_i, const SurfacePoint& x_o) const override {
    const auto r = static_cast<double>(Length(x_o.position_mm - x_i.position_mm));
    const Color first = medium_.first->At(x_o.uv);
    const Color second = medium_.second->At(x_o.uv);
    std::array<float, 3> rd{};
    for (int c = 0; c < 3; ++c) {
      if (const ProfileShape* const shape = shapes_->Find(first[c], second[c])) {
        rd[static_cast<std::size_t>(c)] = static_cast<float>(shape->Rd(r));
      }
    }
    return {rd[0], rd[1], rd[2]};
  }

  RadialDensity Spread() const override {
    constexpr int kFew = 8;
    double finest = std::numeric_limits<double>::infinity();
    double reach = 0;
    ForEachProfile(medium_, kFew, [&](const RadialProfile& p) {
      finest = std::min(finest, p.MeanFreePathMm() / 64);
      reach = std::max(reach, ReachMm(p));
    });
    return RadialDensity(
        [&](double r) {
          double sum = 0;
          ForEachProfile(medium_, kFew, [&](const RadialProfile& p) {
            sum += p.Rd(r) / p.Total();
          });
          return sum;
        },
        finest,
        reach);
  }

  std::unique_ptr<Subsurface> Illuminate(std::vector<LitPoint> lit,
                                         int thread_count) const override {
    return std::make_unique<TexturedGather>(
        medium_, shapes_, GatherPatches(lit, patch_mm_, {}, thread_count));
  }

 private:
  TexturedMedium medium_;
  float patch_mm_;
  std::shared_ptr<const ProfileShapes> shapes_;
};

}  // namespace

float TexturedPatchMm(const TexturedMedium& medium) {
  double smallest = std::numeric_limits<double>::infinity();
  double sum = 0;
  int count = 0;
  ForEachProfile(medium, kPlaces, [&](const RadialProfile& p) {
    smallest = std::min(smallest, p.MeanFreePathMm());
    sum += p.MeanFreePathMm();
    ++count;
  });
  if (count == 0) {
    throw UsageError("a textured medium that scatters nowhere, in no channel");
  }
  constexpr double kPatch = 0.8;
  return static_cast<float>(kPatch * std::max(smallest, 0.1 * sum / count));
}

TexturedTranslucency MakeTextured(const TexturedMedium& medium) {
  if (!(medium.eta >= 1 && std::isfinite(medium.eta))) {
    throw UsageError(
        fmt::format("a medium with refractive index {}: at least 1 is needed (inside "
                    "relative to outside)",
                    medium.eta));
  }
  const float patch_mm = TexturedPatchMm(medium);
  const auto shapes = std::make_shared<const ProfileShapes>(
      medium.profile, static_cast<double>(patch_mm) / std::sqrt(std::numbers::pi));
  return {std::make_shared<TexturedModel>(medium, patch_mm, shapes),
          std::make_shared<Total>(medium, shapes)};
}

}  // namespace nacre::render
