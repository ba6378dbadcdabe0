#pragma once

#include "render/vec.h"

#include <optional>
#include <string>
#include <vector>

namespace nacre::render {

/// A measured medium of [Jensen01, figure 5].
struct JensenMedium {
  const char* name;
  Color sigma_s_prime_per_mm;
  Color sigma_a_per_mm;
  float eta;
};

/// By name, upper and lower case alike.
std::optional<JensenMedium> FindJensenMedium(const std::string& name);
std::vector<std::string> JensenMediumNames();

}  // namespace nacre::render
