// How a measured sample lies on a shape, and whether the sizes can be meant.

#include "render/scene_reader/mapping.h"

#include "render/bounds.h"
#include "render/scene_reader/objects.h"

#include <algorithm>
#include <cmath>

namespace nacre::render {
namespace {

bool HasUv(const Shape& shape) {
  const auto* mesh = std::get_if<TriangleMesh>(&shape.geometry);
  return mesh == nullptr || !mesh->uvs.empty();
}

// Surface over the area that its texture coordinates span, scene units squared.
double AreaOfUnitUv(const Shape& shape) {
  if (const auto* sphere = std::get_if<Sphere>(&shape.geometry)) {
    return 4 * std::numbers::pi * std::pow(static_cast<double>(sphere->radius), 2);
  }
  const auto& mesh = std::get<TriangleMesh>(shape.geometry);
  double uv_area = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vec2 p = mesh.uvs[a];
    const Vec2 q = mesh.uvs[b];
    const Vec2 r = mesh.uvs[c];
    uv_area += 0.5 * std::abs(static_cast<double>((q.x - p.x) * (r.y - p.y) -
                                                  (r.x - p.x) * (q.y - p.y)));
  }
  return uv_area > 0 ? SurfaceArea(mesh) / uv_area : 0;
}

SamplePose ReadPose(Element& element, float mm_per_unit) {
  const Transform to_world = element.ToWorld();
  const Vec3 x = to_world.Vector({1, 0, 0});
  const Vec3 y = to_world.Vector({0, 1, 0});
  const Vec3 z = to_world.Vector({0, 0, 1});
  const float off = std::abs(Length(x) - 1) + std::abs(Length(y) - 1) +
                    std::abs(Length(z) - 1) + std::abs(Dot(x, y)) +
                    std::abs(Dot(y, z)) + std::abs(Dot(z, x));
  if (!(off < 1e-4F)) {
    element.FailAt("toWorld",
                   "a sample can only be moved and turned; its size is set by scale, "
                   "in mm a scene unit");
  }
  return {to_world.Point({0, 0, 0}) * mm_per_unit, Frame(x, y, z)};
}

}  // namespace

SampleOnSurface ReadMapping(Element& element, const Shape& shape, float mm_per_unit) {
  const std::vector<std::pair<std::string, Mapping>> known = {
      {"texture", Mapping::kTexture},
      {"world", Mapping::kWorld},
      {"box", Mapping::kBox},
      {"triplanar", Mapping::kTriplanar}};
  const bool has_uv = HasUv(shape);
  const std::string name = element.String("mapping", has_uv ? "world" : "triplanar");
  const auto found = std::find_if(
      known.begin(), known.end(), [&](const auto& k) { return k.first == name; });
  if (found == known.end()) {
    std::vector<std::string> names;
    names.reserve(known.size());
    for (const auto& k : known) {
      names.push_back(k.first);
    }
    element.FailAt("mapping",
                   fmt::format("no mapping '{}'{}", name, Suggestion(name, names)));
  }
  SampleOnSurface mapping{found->second, ReadPose(element, mm_per_unit)};
  const bool by_uv =
      mapping.mapping == Mapping::kTexture || mapping.mapping == Mapping::kWorld;
  if (by_uv && !has_uv) {
    element.FailAt("mapping",
                   fmt::format("the shape '{}' has no texture coordinates, which "
                               "mapping '{}' goes by; use box or triplanar",
                               shape.name,
                               name));
  }
  if (!has_uv && !element.Has("mapping")) {
    element.document().Note(element.node(),
                            "the shape has no texture coordinates: mapping triplanar");
  }
  return mapping;
}

void NoteScale(Element& element,
               const Shape& shape,
               const Translucency& translucency,
               const WindowSource& source,
               Mapping mapping) {
  Document& document = element.document();
  const auto mm = static_cast<double>(translucency.mm_per_unit);
  const Box box = BoundsOf(shape);
  const double object_mm = mm * static_cast<double>(Length(box.high - box.low));
  const auto core_mm = static_cast<double>(translucency.core_mm);
  if (core_mm > object_mm) {
    document.Note(element.node(),
                  fmt::format("a lit point reaches over {:.4g} mm of the material, but "
                              "the shape is only {:.4g} mm across: is scale, {:g} mm a "
                              "scene unit, meant?",
                              core_mm,
                              object_mm,
                              mm));
  }
  const double width_mm = source.points_x * source.pitch_mm;
  const double height_mm = source.points_y * source.pitch_mm;
  if (mapping == Mapping::kTexture || mapping == Mapping::kWorld) {
    const double enlarged =
        std::sqrt(AreaOfUnitUv(shape) * mm * mm / (width_mm * height_mm));
    if (enlarged > 2 || enlarged < 0.5) {
      document.Note(
          element.node(),
          fmt::format("the shape's texture coordinates draw the sample, {:.4g} x "
                      "{:.4g} mm, {:.3g} times as large, while its light spreads by "
                      "scale, {:g} mm a scene unit",
                      width_mm,
                      height_mm,
                      enlarged,
                      mm));
    }
  }
}

void NoteSmallCores(Document& document) {
  const Camera& camera = document.scene.camera;
  const Vec3 eye = camera.world_from_camera.Point({0, 0, 0});
  for (const Shape& shape : document.scene.shapes) {
    if (!shape.translucency || !(shape.translucency->core_mm > 0)) {
      continue;
    }
    const Box box = BoundsOf(shape);
    const Vec3 nearest{std::clamp(eye.x, box.low.x, box.high.x),
                       std::clamp(eye.y, box.low.y, box.high.y),
                       std::clamp(eye.z, box.low.z, box.high.z)};
    const float pixel = 2 * camera.half_width /
                        static_cast<float>(document.scene.film.width) *
                        Length(nearest - eye);
    const float pixel_mm = pixel * shape.translucency->mm_per_unit;
    if (shape.translucency->core_mm < pixel_mm) {
      document.scene.notes.push_back(fmt::format(
          "{}: a lit point of shape '{}' reaches over {:.4g} mm, less than a pixel "
          "({:.4g} mm): no translucency will be seen; is scale, {:g} mm a scene unit, "
          "meant?",
          document.origin,
          shape.name,
          shape.translucency->core_mm,
          pixel_mm,
          shape.translucency->mm_per_unit));
    }
  }
}

}  // namespace nacre::render
