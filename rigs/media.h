#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>

namespace nacre::rigs {

/// A measured medium in the channels R, G, B. What was measured is the reduced
/// scattering σ_s' = σ_s (1 − g); how it splits into σ_s and g is for the user to say.
struct NamedMedium {
  std::string_view name;  ///< as phantom files write it
  std::array<double, 3> reduced_sigma_s_per_mm{};
  std::array<double, 3> sigma_a_per_mm{};
  double eta = 1;
  std::string_view source;  ///< a key of REFERENCES.md
};

/// [Jensen01, fig. 5], the red absorption of chicken as printed there: 0.015 and 0.018
/// (a table in wide use has a tenth of it); and the cloudy liquids of [Narasimhan06],
/// extrapolated to the undiluted liquid, their η that of water.
std::span<const NamedMedium> NamedMedia();

/// Null if there is none of that name.
const NamedMedium* FindNamedMedium(std::string_view name);

/// All names, for messages: "apple, chicken1, …".
std::string NamedMediaList();

}  // namespace nacre::rigs
