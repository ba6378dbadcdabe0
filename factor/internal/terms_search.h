#pragma once

#include "factor/internal/method.h"

#include <functional>

namespace nacre::factor::internal {

/// The material that the options ask for: all terms, or as many as fit `bytes`, or as
/// few as reach `error`, by bisection over whole materials, rounded, measured and
/// described.
using Describe = std::function<void(const FactorSummary&, Material&)>;
Factorization SearchTerms(Job& job, Method& method, const Describe& describe);

}  // namespace nacre::factor::internal
