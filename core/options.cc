#include "core/options.h"

#include "core/error.h"

#include <fmt/format.h>

namespace nacre::internal {

void CheckRange(const char* name, double value, Range range) {
  if (!(value >= range.min && value <= range.max)) {  // refuses NaN too
    throw UsageError(fmt::format("option {} is {}, but must lie in [{}, {}]",
                                 name,
                                 value,
                                 range.min,
                                 range.max));
  }
}

}  // namespace nacre::internal
