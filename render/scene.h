#pragma once

#include "render/camera.h"
#include "render/film.h"
#include "render/light.h"
#include "render/shape.h"

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace nacre::render {

/// Progressive photon mapping of what glass and mirrors throw on other surfaces.
struct PhotonSettings {
  bool enabled = false;
  std::int64_t count = 250'000;  ///< light paths a map; a sample of each pixel has one
  float initial_radius = 0;      ///< scene units; 0: by the scene's size
  float alpha = 0.7F;            ///< 1: the radius stays
};

struct IntegratorSettings {
  enum class Kind { kPath, kDirect };
  Kind kind = Kind::kPath;
  int max_depth = -1;          ///< edges of a path from camera to light; −1: no limit
  int rr_depth = 5;            ///< from this depth on paths may end by Russian roulette
  bool hide_emitters = false;  ///< lights aren't seen directly
  PhotonSettings photons{};
};

/// All that is in a scene file, ready to render. Lengths in scene units.
struct Scene {
  std::string origin;  ///< the file, for messages
  IntegratorSettings integrator;
  Camera camera;
  Film film;
  int samples_per_pixel = 64;
  std::vector<Shape> shapes;
  std::vector<ShapeInstance> instances;
  std::vector<Light> lights;
  /// What was read but has no effect or another one than elsewhere; for people.
  std::vector<std::string> notes;
  /// Scene, meshes, pictures and materials, for provenance.
  std::vector<std::filesystem::path> files;
};

struct SceneOptions {
  std::map<std::string, std::string>
      defines{};         ///< `$name`s, before the file's defaults
  bool lenient = false;  ///< an unknown word is a note instead of an error
  /// The scene may read files that aren't in its folder. Those that a definition names,
  /// or that lie in a folder it names, it may read anyway.
  bool allow_outside = false;
  /// Of R_d's largest value, that may be missing of a measured material: terms that
  /// bring less aren't evaluated.
  double material_error = 0;
};

/// Reads a scene in the XML of Mitsuba 0.4–0.6. Throws BadData with file:line.
Scene ReadScene(const std::filesystem::path& path, const SceneOptions& options = {});

/// The same from memory; relative paths start at `folder`.
Scene ParseScene(const std::string& xml,
                 const std::string& origin,
                 const std::filesystem::path& folder,
                 const SceneOptions& options = {});

}  // namespace nacre::render
