#include "calibrate/internal/json_numbers.h"

#include <algorithm>
#include <fmt/format.h>

namespace nacre::calibrate::internal {

double Number(const Json& json,
              const char* key,
              const std::string& origin,
              Range range) {
  const auto value = Get<double>(json, key, origin);
  if (!(value >= range.min && value <= range.max)) {
    throw BadData(
        fmt::format("{}: field '{}': {} makes no sense there", origin, key, value));
  }
  return value;
}

std::vector<double> List(const Json& json, const char* key, const std::string& origin) {
  auto values = Get<std::vector<double>>(json, key, origin);
  if (!std::all_of(
          values.begin(), values.end(), [](double x) { return std::isfinite(x); })) {
    throw BadData(fmt::format("{}: field '{}' must hold finite numbers", origin, key));
  }
  return values;
}

}  // namespace nacre::calibrate::internal
