#include "render/obj.h"
#include "render/ply.h"
#include "render/scene_reader/objects.h"
#include "render/serialized.h"

#include <algorithm>
#include <cmath>

namespace nacre::render {
namespace {

void TransformMesh(TriangleMesh& mesh, const Transform& to_world) {
  for (Vec3& p : mesh.positions) {
    p = to_world.Point(p);
  }
  for (Vec3& n : mesh.normals) {
    n = to_world.Normal(n);
  }
  if (to_world.Determinant() < 0) {
    // Mirroring reverses the winding; the normals are right already.
    for (auto& triangle : mesh.triangles) {
      std::swap(triangle[1], triangle[2]);
    }
  }
}

void TurnInsideOut(TriangleMesh& mesh) {
  for (Vec3& n : mesh.normals) {
    n = -n;
  }
  for (auto& triangle : mesh.triangles) {
    std::swap(triangle[1], triangle[2]);
  }
}

TriangleMesh ReadMeshFile(Element& element, const std::string& type) {
  const std::string name = element.String("filename", "");
  if (name.empty()) {
    element.Fail("a mesh needs a <string name=\"filename\">");
  }
  const std::filesystem::path path = element.document().File(element.node(), name);
  SerializedMesh read;
  if (type == "serialized") {
    read = ReadSerialized(path, element.Integer("shapeIndex", 0));
  } else {
    read.mesh = type == "obj" ? ReadObj(path) : ReadPly(path);
  }
  TriangleMesh mesh = std::move(read.mesh);
  if (element.Boolean("faceNormals", read.face_normals)) {
    mesh.normals.clear();
  } else if (mesh.normals.empty()) {
    ComputeNormals(mesh);
  }
  return mesh;
}

TriangleMesh ReadMesh(Element& element, const std::string& type) {
  const Transform to_world = element.ToWorld();
  if (to_world.Determinant() == 0) {
    element.FailAt("toWorld", "the transform flattens the shape");
  }
  TriangleMesh mesh = type == "rectangle" ? MakeRectangle()
                      : type == "disk"    ? MakeDisk()
                      : type == "cube"    ? MakeCube()
                                          : ReadMeshFile(element, type);
  TransformMesh(mesh, to_world);
  if (element.Boolean("flipNormals", false)) {
    TurnInsideOut(mesh);
  }
  const MeshReport report = CheckMesh(mesh, element.document().Where(element.node()));
  if (report.degenerate_triangles_dropped > 0) {
    element.document().Note(element.node(),
                            fmt::format("{} triangles without area were left out",
                                        report.degenerate_triangles_dropped));
  }
  return mesh;
}

Sphere TransformSphere(const Element& element,
                       const Sphere& sphere,
                       const Transform& to_world) {
  const Vec3 x = to_world.Vector(sphere.axes.ToWorld({1, 0, 0}));
  const Vec3 y = to_world.Vector(sphere.axes.ToWorld({0, 1, 0}));
  const Vec3 z = to_world.Vector(sphere.axes.ToWorld({0, 0, 1}));
  const float scale = Length(x);
  const float shear = std::abs(Dot(x, y)) + std::abs(Dot(y, z)) + std::abs(Dot(z, x));
  if (!(scale > 0) ||
      std::abs(Length(y) - scale) + std::abs(Length(z) - scale) > 1e-4F * scale ||
      shear > 1e-4F * scale * scale) {
    element.FailAt("toWorld",
                   "a sphere can only be moved, turned and scaled evenly; use a mesh "
                   "for an ellipsoid");
  }
  Sphere moved = sphere;
  moved.center = to_world.Point(sphere.center);
  moved.radius = scale * sphere.radius;
  moved.axes = Frame(x / scale, y / scale, z / scale);
  return moved;
}

Sphere ReadSphere(Element& element) {
  const Transform to_world = element.ToWorld();
  Sphere sphere;
  sphere.center = element.Point("center", {0, 0, 0});
  sphere.radius = static_cast<float>(
      InRange(element, "radius", element.Float("radius", 1), {1e-9, 1e9}));
  sphere.inward = element.Boolean("flipNormals", false);
  return TransformSphere(element, sphere, to_world);
}

BsdfPtr ReadShapeBsdf(Element& element) {
  std::vector<BsdfPtr> found;
  for (const Element& child : element.Objects("bsdf")) {
    found.push_back(ReadBsdf(child));
  }
  for (const Element& ref : element.Objects("ref")) {
    found.push_back(
        FindById(element.document(), ref.node(), element.document().bsdfs, "bsdf"));
  }
  if (found.size() > 1) {
    element.Fail("a shape has one bsdf");
  }
  return found.empty() ? nullptr : found.front();
}

void ReadAreaEmitter(Element emitter, Shape& shape) {
  if (emitter.type() != "area") {
    emitter.Fail(fmt::format("a shape shines by an emitter of type area, not {}",
                             emitter.type()));
  }
  shape.radiance = emitter.Spectrum("radiance", {1, 1, 1});
  shape.hidden = emitter.Boolean("hidden", false);
  shape.sampling_weight = static_cast<float>(
      InRange(emitter, "samplingWeight", emitter.Float("samplingWeight", 1), {0, 1e9}));
  emitter.Finish();
}

}  // namespace

Shape Transformed(const Element& element, Shape shape, const Transform& to_world) {
  if (auto* const mesh = std::get_if<TriangleMesh>(&shape.geometry)) {
    TransformMesh(*mesh, to_world);
  } else {
    auto& sphere = std::get<Sphere>(shape.geometry);
    sphere = TransformSphere(element, sphere, to_world);
  }
  return shape;
}

std::optional<Shape> MakeShape(Element element) {
  const std::string type = element.type();
  const std::vector<std::string> known = {"obj",
                                          "ply",
                                          "serialized",
                                          "sphere",
                                          "rectangle",
                                          "disk",
                                          "cube",
                                          "shapegroup",
                                          "instance"};
  if (std::find(known.begin(), known.end() - 2, type) == known.end() - 2) {
    UnknownPlugin(element, known);
    return std::nullopt;
  }
  Shape shape;
  shape.name = element.id().empty() ? type : element.id();
  if (type == "sphere") {
    shape.geometry = ReadSphere(element);
  } else {
    shape.geometry = ReadMesh(element, type);
  }
  shape.bsdf = ReadShapeBsdf(element);
  for (const Element& child : element.Objects("emitter")) {
    if (shape.radiance) {
      element.Fail("a shape has one emitter");
    }
    ReadAreaEmitter(child, shape);
  }
  for (const Element& child : element.Objects("subsurface")) {
    if (shape.translucency) {
      element.Fail("a shape has one subsurface model");
    }
    ReadSubsurface(child, shape);
  }
  shape.interior = ReadMediumOr(element, "interior");
  shape.exterior = ReadMediumOr(element, "exterior");
  if (shape.bsdf == nullptr && !shape.radiance && !shape.translucency &&
      shape.interior == nullptr && shape.exterior == nullptr) {
    shape.bsdf = MakeDiffuse(MakeConstant({0.5F, 0.5F, 0.5F}));
  }
  element.Finish();
  return shape;
}

void ReadShape(const Element& element) {
  if (element.type() == "shapegroup") {
    ReadShapeGroup(element);
  } else if (element.type() == "instance") {
    ReadInstance(element);
  } else if (std::optional<Shape> shape = MakeShape(element)) {
    element.document().scene.shapes.push_back(std::move(*shape));
  }
}

}  // namespace nacre::render
