#include "render/scene_reader/objects.h"

namespace nacre::render {

void ReadShapeGroup(Element element) {
  Document& document = element.document();
  if (element.id().empty()) {
    element.Fail("a shapegroup needs an id, by which instances name it");
  }
  ShapeGroup group;
  group.first = document.scene.shapes.size();
  for (const Element& child : element.Objects("shape")) {
    if (child.type() == "shapegroup" || child.type() == "instance") {
      child.Fail("a shapegroup holds shapes alone");
    }
    std::optional<Shape> shape = MakeShape(child);
    if (!shape) {
      continue;
    }
    if (shape->radiance) {
      child.Fail("a shape that shines can't be in a shapegroup");
    }
    if (shape->translucency) {
      group.translucent.push_back(std::move(*shape));
    } else {
      shape->instanced = true;
      document.scene.shapes.push_back(std::move(*shape));
    }
  }
  group.count = document.scene.shapes.size() - group.first;
  if (group.count + group.translucent.size() == 0) {
    element.Fail("a shapegroup without a shape");
  }
  element.Finish();
  document.shape_groups[element.id()] = std::move(group);
}

void ReadInstance(Element element) {
  Document& document = element.document();
  const std::vector<Element> refs = element.Objects("ref");
  if (refs.size() != 1) {
    element.Fail(fmt::format("an instance needs one <ref> to a shapegroup, not {}",
                             refs.size()));
  }
  const ShapeGroup group =
      FindById(document, refs.front().node(), document.shape_groups, "shapegroup");
  const Transform to_world = element.ToWorld();
  if (to_world.Determinant() == 0) {
    element.FailAt("toWorld", "the transform flattens the shapes");
  }
  element.Finish();
  if (group.count > 0) {
    document.scene.instances.push_back({group.first, group.count, to_world});
  }
  for (const Shape& shape : group.translucent) {
    document.scene.shapes.push_back(Transformed(element, shape, to_world));
  }
}

}  // namespace nacre::render
