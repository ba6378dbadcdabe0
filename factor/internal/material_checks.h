#pragma once

#include "factor/material.h"

namespace nacre::factor::internal {

/// The part of Validate that needs no maps, kernels, clusters, scales and albedo.
void ValidateFields(const Material& material, const std::string& origin);

}  // namespace nacre::factor::internal
