#pragma once

#include "factor/material.h"

#include <vector>

namespace nacre::factor::internal {

/// Leaves these terms (ascending) of a sum, steps and all; scales and albedo stay.
void KeepTerms(const std::vector<int>& kept, Material& m);

/// Takes those terms out of a sum that are 0 everywhere, as rounding may leave them; of
/// all, the first stays. Evaluates to the same bits. Returns how many were taken out.
int DropIdleTerms(Material& m);

}  // namespace nacre::factor::internal
