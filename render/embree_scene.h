#pragma once

#include "render/camera.h"
#include "render/shape.h"

#include <memory>
#include <vector>

namespace nacre::render {

/// Rays against the shapes of a scene. The only user of Embree.
class EmbreeScene {
 public:
  /// `shapes` must outlive it.
  EmbreeScene(const std::vector<Shape>& shapes,
              std::vector<ShapeInstance> instances,
              int thread_count);
  ~EmbreeScene();
  EmbreeScene(const EmbreeScene&) = delete;
  EmbreeScene& operator=(const EmbreeScene&) = delete;

  /// The nearest hit, or false.
  bool Intersect(const Ray& ray, SurfaceHit& hit) const;
  bool Occluded(const Ray& ray) const;

  Vec3 center() const { return center_; }
  float radius() const { return radius_; }  ///< of a sphere around everything

 private:
  struct Handles;
  const std::vector<Shape>& shapes_;
  std::vector<ShapeInstance> instances_;
  std::unique_ptr<Handles> handles_;
  Vec3 center_;
  float radius_ = 0;
};

/// The hit moved off its surface to the side of `direction`, by more than the error of
/// its position.
Vec3 OffsetOrigin(const SurfaceHit& hit, Vec3 direction);

}  // namespace nacre::render
