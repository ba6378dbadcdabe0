#pragma once

#include "core/exr.h"
#include "core/json_fwd.h"
#include "render/film.h"
#include "render/subsurface/subsurface.h"

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace nacre::render {

/// Light that enters one translucent object and light that leaves it, in channels.
struct ObjectEnergy {
  std::string name;
  double entered[3] = {};  ///< W through the surface, at the lit points
  double left[3] = {};     ///< W: their area times the mean exitance at some of them
  double error[3] = {};    ///< standard error of that
};

/// What has to hold of every picture, as measured at its end.
struct Invariants {
  std::int64_t not_finite = 0;  ///< pixels with a NaN or an infinity
  std::int64_t negative = 0;    ///< pixels below 0 where the filter is nowhere
  /// Translucent ones with as many lit points as their model asks for.
  std::vector<ObjectEnergy> objects;

  /// Largest of left / entered over objects and channels; 0 if nothing was lit.
  double EnergyRatio() const;
  std::string Brief() const;  ///< one line
  /// What a person should know of what doesn't hold; empty if all does.
  std::vector<std::string> Warnings() const;
  Json ToJson() const;
};

/// Counts the pixels that no light can make.
void CheckPixels(const ExrPart& image, const Film& film, Invariants& found);

/// Weighs what leaves translucent objects against what entered them: by the exitance at
/// some of the lit points, so many of an object that all together stay below a
/// thousand.
class EnergyCheck {
 public:
  /// Before a model takes the points of an object: sums what enters and keeps places.
  /// `object_count` objects share the thousand.
  void Enter(const std::string& name,
             std::span<const LitPoint> lit,
             std::int64_t object_count);
  /// The model of the object that entered last, with its light. Must outlive this.
  void SetModel(const Subsurface& model) { objects_.back().model = &model; }
  /// Asks the models.
  std::vector<ObjectEnergy> Measure(int thread_count) const;

 private:
  struct Object {
    ObjectEnergy energy;
    const Subsurface* model = nullptr;
    double area_mm2 = 0;
    std::vector<SurfacePoint> places;
  };
  std::vector<Object> objects_;
};

}  // namespace nacre::render
