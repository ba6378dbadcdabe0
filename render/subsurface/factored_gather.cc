#include "core/error.h"
#include "render/subsurface/material_windows.h"
#include "render/subsurface/models.h"
#include "render/subsurface/patch_tree.h"

#include <array>
#include <cmath>
#include <limits>
#include <mutex>
#include <numbers>
#include <span>

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

/// Where in a window, in columns and rows, what lies at `plane` in the tangent plane
/// and √`squared` away in space is looked up: in the direction of the one, at the
/// distance of the other.
Vec2 InWindow(Vec2 plane, float squared) {
  const float in_plane = plane.x * plane.x + plane.y * plane.y;
  if (in_plane > 1e-8F * squared) {
    const float stretch = std::sqrt(squared / in_plane);
    return {plane.x * stretch, plane.y * stretch};
  }
  // Straight through, any direction is as good as another.
  return {std::sqrt(squared), 0};
}

class FactoredGather final : public Subsurface {
 public:
  FactoredGather(std::shared_ptr<const MaterialWindows> windows,
                 std::vector<Patch> patches,
                 const MaterialMapping& mapping,
                 const FactoredOptions& options)
      : windows_(std::move(windows)),
        along_surface_(mapping.mapping() == Mapping::kTexture),
        tree_(std::move(patches)),
        per_mm_(1 / windows_->pitch_mm()),
        reach_mm_(std::numbers::sqrt2_v<float> * (windows_->radius() + 0.5F) *
                  windows_->pitch_mm()),
        max_relative_extent_(static_cast<float>(options.max_relative_extent)) {
    for (const Patch& patch : tree_.patches()) {
      first_.push_back(std::ssize(sources_));
      for (const SamplePlace& place : mapping.Places(patch.point)) {
        sources_.push_back(SourceOf(patch, place));
      }
    }
    first_.push_back(std::ssize(sources_));
    for (const PatchTree::Node& node : tree_.nodes()) {
      Source source = SourcesOf(node.brightest).front();
      source.flux_w = ToLanes(FluxThroughBrightest(node, source.window));
      source.variance = node.variance_mm2 * per_mm_ * per_mm_;
      nodes_.push_back(source);
    }
  }

  Color Gather(const SurfacePoint& x_o, std::int64_t& pairs) const override {
    // First what to look up, then the looking up: the windows are many and lie all over
    // the memory, and so their cells can be on the way while others are being read.
    thread_local std::vector<Lookup> lookups;
    lookups.clear();
    const auto add_patch = [&](std::int32_t index, Vec3 d_mm) {
      for (const Source& source : SourcesOf(index)) {
        const SurfacePoint& x_i =
            tree_.patches()[static_cast<std::size_t>(index)].point;
        AddPatch(source,
                 along_surface_ ? OnSurface(MaterialMapping::AlongSurface(x_i, x_o))
                                : Project(d_mm, source),
                 lookups);
      }
    };
    tree_.Visit(
        x_o.position_mm,
        reach_mm_,
        tree_.SmallerThan(max_relative_extent_),
        [&](std::int32_t index, Vec3 d_mm) {
          const Source& node = nodes_[static_cast<std::size_t>(index)];
          // Texture coordinates have no mean: there may be a seam in between.
          if (along_surface_ || !AddCluster(node, d_mm, lookups)) {
            tree_.VisitPatches(index, x_o.position_mm, add_patch);
          }
        },
        add_patch);
    pairs += std::ssize(lookups);
    constexpr std::size_t kAhead = 12;
    ColorLanes sum;
    for (std::size_t n = 0; n < lookups.size(); ++n) {
      const Lookup& ahead = lookups[std::min(n + kAhead, lookups.size() - 1)];
      windows_->Prefetch(
          ahead.source->window, ahead.squared, ahead.cell.x, ahead.cell.y);
      const Lookup& now = lookups[n];
      sum += windows_->At(now.source->window, now.squared, now.cell.x, now.cell.y) *
             (now.source->flux_w * now.weight);
    }
    return {sum.v[0], sum.v[1], sum.v[2]};
  }

 private:
  /// A patch, or a cluster of them, as this model sees it; lengths in pitches of the
  /// material.
  struct Source {
    ColorLanes flux_w;
    Vec3 column_axis;  ///< of the window, per mm: +u
    Vec3 row_axis;     ///< −v
    Vec2 extent_a;     ///< of a patch: standard deviations, in columns and rows
    Vec2 extent_b;
    Vec2 beside;         ///< of x_i from its window's grid point
    float variance = 0;  ///< along each direction
    int window = 0;
  };
  struct Lookup {
    const Source* source;
    Vec2 cell;      ///< x_o from the grid point of the source's window
    float squared;  ///< |x_o − x_i|²
    float weight;
  };
  /// From x_i to x_o, in pitches.
  struct Offset {
    Vec2 plane;         ///< columns and rows
    float squared = 0;  ///< distance in space, squared
  };

  Source SourceOf(const Patch& patch, const SamplePlace& place) const {
    Source source;
    const MaterialWindows::Entry entry = windows_->EntryAt(place.uv);
    source.flux_w = ToLanes(patch.flux_w * place.weight) * entry.scale;
    source.column_axis = place.tangent_u * per_mm_;
    source.row_axis = -(place.tangent_v * per_mm_);
    const auto in_plane = [&](Vec3 v) {
      return Vec2{Dot(v, source.column_axis), Dot(v, source.row_axis)};
    };
    source.extent_a = in_plane(patch.axis_a_mm);
    source.extent_b = in_plane(patch.axis_b_mm);
    source.variance = 0.5F *
                      (Dot(patch.axis_a_mm, patch.axis_a_mm) +
                       Dot(patch.axis_b_mm, patch.axis_b_mm)) *
                      per_mm_ * per_mm_;
    source.window = entry.window;
    source.beside = entry.beside;
    return source;
  }

  std::span<const Source> SourcesOf(std::int32_t patch) const {
    const auto p = static_cast<std::size_t>(patch);
    return {sources_.data() + first_[p], sources_.data() + first_[p + 1]};
  }

  /// The flux that has to enter through `window` for what leaves to be what the albedos
  /// of a node's patches say.
  Color FluxThroughBrightest(const PatchTree::Node& node, int window) const {
    const Color albedo = windows_->Albedo(window);
    Color leaving;
    for (std::int32_t p = node.begin; p < node.end; ++p) {
      for (const Source& source : SourcesOf(p)) {
        const ColorLanes& flux = source.flux_w;
        leaving +=
            Color{flux.v[0], flux.v[1], flux.v[2]} * windows_->Albedo(source.window);
      }
    }
    const auto through = [](float out, float a, float plain) {
      return a > 0 ? out / a : plain;
    };
    return {through(leaving.x, albedo.x, node.flux_w.x),
            through(leaving.y, albedo.y, node.flux_w.y),
            through(leaving.z, albedo.z, node.flux_w.z)};
  }

  /// By a distance along the tangents at x_i.
  Offset OnSurface(Vec2 d_mm) const {
    const Vec2 plane{d_mm.x * per_mm_, -d_mm.y * per_mm_};
    return {plane, plane.x * plane.x + plane.y * plane.y};
  }

  Offset Project(Vec3 d_mm, const Source& source) const {
    return {{Dot(d_mm, source.column_axis), Dot(d_mm, source.row_axis)},
            Dot(d_mm, d_mm) * per_mm_ * per_mm_};
  }

  /// One lookup, unless it is out of reach.
  void Add(const Source& source,
           Vec2 cell,
           float squared,
           float weight,
           std::vector<Lookup>& lookups) const {
    if (std::max(std::abs(cell.x), std::abs(cell.y)) < windows_->radius()) {
      lookups.push_back({&source, cell, squared, weight});
    }
  }

  void AddPatch(const Source& source,
                const Offset& d,
                std::vector<Lookup>& lookups) const {
    const Vec2 cell = InWindow(d.plane, d.squared) + source.beside;
    if (d.squared > kNearPitches * kNearPitches) {
      Add(source, cell, AsOfPoint(d, source), 1, lookups);
      return;
    }
    // The mean over the patch by the product of two two-point Gauss rules.
    const float outside =
        std::max(0.0F, d.squared - d.plane.x * d.plane.x - d.plane.y * d.plane.y);
    const Vec2 sum = source.extent_a + source.extent_b;
    const Vec2 difference = source.extent_a - source.extent_b;
    for (const Vec2 p :
         {d.plane + sum, d.plane - sum, d.plane + difference, d.plane - difference}) {
      Add(source, cell, p.x * p.x + p.y * p.y + outside, 0.25F, lookups);
    }
  }

  /// False if the cluster is too near to stand as one source.
  bool AddCluster(const Source& source, Vec3 d_mm, std::vector<Lookup>& lookups) const {
    const Offset d = Project(d_mm, source);
    if (d.squared < kNearPitches * kNearPitches) {
      return false;
    }
    const float squared = AsOfPoint(d, source);
    Add(source, InWindow(d.plane, squared), squared, 1, lookups);
    return true;
  }

  /// What is spread out in its plane gives more than its centre. For R_d ~ r^−n,
  /// variance v along each direction, and s² the share of the plane in r², the mean is
  /// that of a point at r (1 − v/(2 r²) ((n + 2) s² − 2)), to second order; n is about
  /// 3 where it matters.
  static float AsOfPoint(const Offset& d, const Source& source) {
    const float in_plane = d.plane.x * d.plane.x + d.plane.y * d.plane.y;
    const float nearer =
        1 - 0.5F * source.variance / d.squared * (5 * in_plane / d.squared - 2);
    return d.squared * nearer * nearer;
  }

  std::shared_ptr<const MaterialWindows> windows_;
  bool along_surface_;
  PatchTree tree_;
  std::vector<Source> sources_;
  std::vector<std::ptrdiff_t> first_;  ///< of a patch, among the sources; and the end
  std::vector<Source> nodes_;
  float per_mm_;
  float reach_mm_;
  float max_relative_extent_;
};

class Factored final : public SubsurfaceModel {
 public:
  Factored(const std::shared_ptr<const WindowSource>& source,
           const FactoredOptions& options,
           const SampleOnSurface& mapping)
      : windows_(std::make_shared<MaterialWindows>(source, options.window_cache_mb)),
        mapping_(mapping.mapping,
                 mapping.pose,
                 static_cast<float>(source->points_x * source->pitch_mm),
                 static_cast<float>(source->points_y * source->pitch_mm)),
        eta_(static_cast<float>(source->eta)),
        options_(options) {}

  float Eta() const override { return eta_; }
  float PatchSizeMm() const override {
    return windows_->pitch_mm() / static_cast<float>(options_.patches_per_pitch);
  }

  // Where the light has an edge, so has the exitance, as sharp as R_d's peak.
  float ExitanceSpacingMm() const override { return windows_->pitch_mm() / 4; }

  Color Rd(const SurfacePoint& x_i, const SurfacePoint& x_o) const override {
    const Vec3 d = (x_o.position_mm - x_i.position_mm) / windows_->pitch_mm();
    ColorLanes sum;
    for (const SamplePlace& place : mapping_.Places(x_i)) {
      Vec2 plane{Dot(d, place.tangent_u), -Dot(d, place.tangent_v)};
      float squared = Dot(d, d);
      if (mapping_.mapping() == Mapping::kTexture) {
        const Vec2 along = MaterialMapping::AlongSurface(x_i, x_o);
        plane = {along.x / windows_->pitch_mm(), -along.y / windows_->pitch_mm()};
        squared = plane.x * plane.x + plane.y * plane.y;
      }
      const MaterialWindows::Entry entry = windows_->EntryAt(place.uv);
      const Vec2 cell = InWindow(plane, squared) + entry.beside;
      sum += windows_->At(entry.window, squared, cell.x, cell.y) * entry.scale *
             place.weight;
    }
    return {sum.v[0], sum.v[1], sum.v[2]};
  }

  // The mean over some windows and directions.
  RadialDensity Spread() const override {
    const double pitch = static_cast<double>(windows_->pitch_mm());
    const double reach =
        std::numbers::sqrt2 * (static_cast<double>(windows_->radius()) + 0.5) * pitch;
    constexpr int kPlaces = 4;
    constexpr int kDirections = 16;
    const auto mean = [&](double r_mm) {
      const auto r = static_cast<float>(r_mm / pitch);
      double sum = 0;
      for (int n = 0; n < kPlaces * kPlaces * kDirections; ++n) {
        const int place = n / kDirections;
        const int column = place % kPlaces;
        const int row = place / kPlaces;
        const int window = windows_
                               ->EntryAt({(static_cast<float>(column) + 0.5F) / kPlaces,
                                          (static_cast<float>(row) + 0.5F) / kPlaces})
                               .window;
        const float angle = 2 * std::numbers::pi_v<float> *
                            static_cast<float>(n % kDirections) / kDirections;
        const ColorLanes rd =
            windows_->At(window, r * r, r * std::cos(angle), r * std::sin(angle));
        sum += static_cast<double>(rd.v[0] + rd.v[1] + rd.v[2]);
      }
      return sum;
    };
    return RadialDensity(mean, pitch / 8, reach);
  }

  ModelUse Use() const override {
    const std::lock_guard lock(lit_mutex_);
    std::int64_t evaluated = windows_->evaluated_count();
    for (const auto& windows : lit_windows_) {
      evaluated += windows->evaluated_count();
    }
    return {.windows = evaluated,
            .windows_total = windows_->window_count(),
            .tiles = windows_->source().tiles_read(),
            .tiles_total = windows_->source().tiles_total(),
            .channels = windows_->source().channels_read(),
            .terms = windows_->source().terms_used(),
            .terms_total = windows_->source().terms_total()};
  }

  std::unique_ptr<Subsurface> Illuminate(std::vector<LitPoint> lit,
                                         int thread_count) const override {
    // Of projections a point has several places, which overlap: they blur borders.
    const bool by_uv = mapping_.mapping() == Mapping::kTexture ||
                       mapping_.mapping() == Mapping::kWorld;
    const auto windows = WindowsFor(lit);
    const auto part_of =
        by_uv
            ? PartFunction([&](const SurfacePoint& p) { return windows->PartAt(p.uv); })
            : PartFunction();
    return std::make_unique<FactoredGather>(
        windows,
        GatherPatches(lit, PatchSizeMm(), part_of, thread_count),
        mapping_,
        options_);
  }

 private:
  /// With the colours that there is light of, so that the others needn't be read.
  std::shared_ptr<const MaterialWindows> WindowsFor(
      const std::vector<LitPoint>& lit) const {
    std::array<bool, 3> colours{};
    for (const LitPoint& point : lit) {
      for (std::size_t c = 0; c < 3; ++c) {
        colours[c] = colours[c] || point.flux_density[static_cast<int>(c)] > 0;
      }
    }
    if (colours[0] && colours[1] && colours[2]) {
      return windows_;
    }
    auto windows = std::make_shared<const MaterialWindows>(
        windows_->source_ptr(), options_.window_cache_mb, colours);
    const std::lock_guard lock(lit_mutex_);
    lit_windows_.push_back(windows);
    return windows;
  }

  std::shared_ptr<const MaterialWindows> windows_;
  mutable std::mutex lit_mutex_;
  mutable std::vector<std::shared_ptr<const MaterialWindows>> lit_windows_;
  MaterialMapping mapping_;
  float eta_;
  FactoredOptions options_;
};

}  // namespace

std::shared_ptr<const SubsurfaceModel> MakeMeasured(
    const std::shared_ptr<const WindowSource>& source,
    const FactoredOptions& options,
    const SampleOnSurface& mapping) {
  Expect(source != nullptr, "a measured subsurface model needs a source");
  Validate(options);
  return std::make_shared<Factored>(source, options, mapping);
}

std::shared_ptr<const SubsurfaceModel> MakeFactored(
    std::shared_ptr<const factor::Material> material,
    const FactoredOptions& options,
    const SampleOnSurface& mapping) {
  return MakeMeasured(MakeMaterialSource(std::move(material)), options, mapping);
}

}  // namespace nacre::render
