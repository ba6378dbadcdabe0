#pragma once

#include "render/scene_reader/element.h"
#include "render/shape.h"

namespace nacre::render {

/// Reads an analytic model of that type if one of its parameters is a texture, or if
/// there are places or channels where light doesn't spread: those become diffuse, by
/// the shape's bsdf. False, and nothing is done, for all others.
bool ReadTexturedModel(Element& element,
                       const std::string& type,
                       Shape& shape,
                       Translucency& translucency);

}  // namespace nacre::render
