#include "render/subsurface/dipole_profile.h"

#include "core/error.h"

#include <cmath>
#include <fmt/format.h>
#include <numbers>

namespace nacre::render {

using std::numbers::pi;

namespace {

void Check(double sigma_a_per_mm, double sigma_s_prime_per_mm, double reflectance) {
  const double sigma_t = sigma_a_per_mm + sigma_s_prime_per_mm;
  if (!(sigma_a_per_mm >= 0 && sigma_s_prime_per_mm >= 0 && sigma_t > 0 &&
        std::isfinite(sigma_t))) {
    throw UsageError(
        fmt::format("a dipole with sigma_a {} and sigma_s' {} per mm: both "
                    "have to be finite and not negative, one not zero",
                    sigma_a_per_mm,
                    sigma_s_prime_per_mm));
  }
  if (!(reflectance >= 0 && reflectance < 1)) {
    throw UsageError(
        fmt::format("a dipole's internal reflectance {} isn't in [0, 1)", reflectance));
  }
}

PointSourceProfile MakeProfile(double sigma_a_per_mm,
                               double sigma_s_prime_per_mm,
                               double internal_reflectance) {
  Check(sigma_a_per_mm, sigma_s_prime_per_mm, internal_reflectance);
  const double sigma_t = sigma_a_per_mm + sigma_s_prime_per_mm;
  const double a = (1 + internal_reflectance) / (1 - internal_reflectance);
  const double weight = sigma_s_prime_per_mm / sigma_t / (4 * pi);
  const double z = 1 / sigma_t;
  return {{{z, weight, 0}, {z * (1 + 4 * a / 3), weight, 0}},
          std::sqrt(3 * sigma_a_per_mm * sigma_t),
          z};
}

}  // namespace

DipoleProfile::DipoleProfile(double sigma_a_per_mm,
                             double sigma_s_prime_per_mm,
                             double internal_reflectance)
    : PointSourceProfile(
          MakeProfile(sigma_a_per_mm, sigma_s_prime_per_mm, internal_reflectance)) {}

}  // namespace nacre::render
