#pragma once

#include "core/json.h"
#include "core/options.h"

#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

/// Numbers out of a JSON object, checked. All throw BadData naming `origin` and key.
namespace nacre::calibrate::internal {

constexpr Range kPositive{std::numeric_limits<double>::min(), 1e300};
constexpr Range kNotNegative{0, 1e300};
constexpr Range kFinite{-1e300, 1e300};

double Number(const Json& json,
              const char* key,
              const std::string& origin,
              Range range = kFinite);

/// Any count of finite numbers.
std::vector<double> List(const Json& json, const char* key, const std::string& origin);

}  // namespace nacre::calibrate::internal
