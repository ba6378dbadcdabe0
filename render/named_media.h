#pragma once

#include "render/vec.h"

#include <optional>
#include <string>
#include <vector>

namespace nacre::render {

/// A measured medium of [Jensen01, figure 5], of which the reduced scattering is known
/// (g = 0), or of [Narasimhan06, table 1].
struct NamedMedium {
  const char* name;
  Color sigma_s_per_mm;
  Color sigma_a_per_mm;
  Color g;
  float eta;

  Color SigmaSPrime() const { return sigma_s_per_mm * (Color{1, 1, 1} - g); }
};

/// By name, upper and lower case alike, with or without blanks.
std::optional<NamedMedium> FindNamedMedium(const std::string& name);
std::vector<std::string> NamedMediaNames();

}  // namespace nacre::render
