#pragma once

#include "core/ranks.h"

namespace nacre::factor::internal {

/// Who does a work, which doesn't change a bit of what comes of it.
struct Workers {
  int thread_count = 0;
  const Ranks* ranks = nullptr;  ///< collective calls, unless null
};

}  // namespace nacre::factor::internal
