#pragma once

#include <nlohmann/json_fwd.hpp>

namespace nacre {

/// Keeps the order in which keys were written, so that files stay readable. This header
/// is enough to declare functions that return it; core/json.h defines it.
using Json = nlohmann::ordered_json;

}  // namespace nacre
