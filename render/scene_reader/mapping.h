#pragma once

#include "render/scene_reader/element.h"
#include "render/subsurface/models.h"

namespace nacre::render {

/// `mapping` and `toWorld` of a measured material on `shape`; without them by texture
/// coordinates, or for a mesh that has none, by three projections.
SampleOnSurface ReadMapping(Element& element, const Shape& shape, float mm_per_unit);

/// Notes a core that is larger than the object, and a sample that isn't drawn in the
/// size in which its light spreads.
void NoteScale(Element& element,
               const Shape& shape,
               const Translucency& translucency,
               const WindowSource& source,
               Mapping mapping);

/// Notes cores that are smaller than a pixel.
void NoteSmallCores(Document& document);

}  // namespace nacre::render
