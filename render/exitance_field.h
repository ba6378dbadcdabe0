#pragma once

#include "render/exitance_source.h"

#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

namespace nacre::render {

/// The exitance over one translucent shape, which depends on the place alone: asked of
/// the model once at each point of a grid on the surface, when it is first needed, and
/// interpolated between. Every value is a function of its place only, so the order in
/// which threads ask changes nothing.
///
/// On a mesh the grid is the vertices where triangles are small, else a barycentric
/// grid a triangle; on a sphere it is longitude and latitude.
class ExitanceField final : public ExitanceSource {
 public:
  /// `spacing_mm`: at most this far apart, but for triangles no longer than two patches
  /// of the model, whose vertices will do; 0 asks the model at every hit. Of vertices
  /// within a few patches one stands for all in what is blurred. The references must
  /// outlive it.
  ExitanceField(const Shape& shape,
                std::unique_ptr<const Subsurface> subsurface,
                float spacing_mm,
                float patch_mm);

  /// At a hit of the shape. What is dim may be a grid's spacing off; what is blurred
  /// may come from anywhere within a few of them, so that there is less to ask.
  Color At(const SurfaceHit& hit, const ExitanceQuery& query) const override;
  Color At(const SurfaceHit& hit, PathCounters& counters) const;

  /// Points of the grid; 0 if there is none because it was too large or not wanted.
  std::int64_t grid_size() const { return grid_size_; }

 private:
  // NaN in `r` until known; `r` is written last and read first.
  struct Value {
    std::atomic<float> r;
    std::atomic<float> g;
    std::atomic<float> b;
  };

  void PlanMesh(const TriangleMesh& mesh, float spacing);
  void PlanSphere(const Sphere& sphere, float spacing);
  void Allocate(std::int64_t count);
  void ChooseForBlurred();

  Color AtCorner(const SurfaceHit& hit, Sight sight, PathCounters& counters) const;
  Color AtCoarseNode(const SurfaceHit& hit, PathCounters& counters) const;
  Color AtMesh(const SurfaceHit& hit, PathCounters& counters) const;
  Color AtSphere(const SurfaceHit& hit, PathCounters& counters) const;
  Color AtVertex(std::uint32_t vertex, PathCounters& counters) const;
  Color AtNode(const SurfaceHit& hit, int i, int j, PathCounters& counters) const;
  Color AtLatitude(int i, int j, PathCounters& counters) const;

  template <class MakePoint>
  Color Lookup(std::int64_t slot,
               PathCounters& counters,
               const MakePoint& make_point) const;

  const Shape& shape_;
  std::unique_ptr<const Subsurface> subsurface_;
  float mm_per_unit_;
  float patch_mm_;
  std::int64_t grid_size_ = 0;
  std::unique_ptr<Value[]> values_;
  // Meshes: divisions of a triangle's sides and its first slot (if more than 1).
  std::vector<std::int32_t> divisions_;
  std::vector<std::int64_t> first_slot_;
  std::vector<SurfacePoint> vertices_;
  std::vector<std::uint32_t> for_blurred_;  ///< the vertex that stands for a vertex
  // Spheres.
  int columns_ = 0;
  int rows_ = 0;
};

}  // namespace nacre::render
