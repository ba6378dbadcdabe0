#include "rigs/media_skin.h"

#include "core/error.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace nacre::rigs {
namespace {

// Molar extinction of haemoglobin, cm⁻¹ M⁻¹, every 10 nm from 400 to 720 nm [Prahl99].
constexpr std::size_t kEntries = 33;
constexpr double kStepNm = 10;
constexpr std::array<double, kEntries> kOxy = {
    266232,  466840,  480360,  246072,  102580,  62816, 44480, 33209.2, 26629.2,
    23684.4, 20932.8, 20035.2, 24202.4, 39956.8, 53236, 43016, 32613.2, 44496,
    50104,   14400.8, 3200,    1506,    942,     610,   442,   368,     319.6,
    294,     277.6,   276,     290,     314,     348};
constexpr std::array<double, kEntries> kDeoxy = {
    223296,  303956,  407560,  528600,  413280,  103292, 23388.8, 16156.4, 14550,
    16684,   20862,   25773.6, 31589.6, 39036.4, 46592,  53412,   53788,   45072,
    37020,   28324.4, 14677.2, 9443.6,  6509.6,  5148.8, 4345.2,  3750.12, 3226.56,
    2795.12, 2407.92, 2051.96, 1794.28, 1540.48, 1325.88};

double BloodAbsorption(const std::array<double, kEntries>& extinction,
                       double wavelength_nm) {
  Expect(wavelength_nm >= kSkinWavelengthsNm.min &&
             wavelength_nm <= kSkinWavelengthsNm.max,
         "a wavelength that the haemoglobin table covers");
  constexpr double kGramsPerLitre = 150;
  constexpr double kGramsPerMole = 64500;
  constexpr double kMmPerCm = 10;
  const double at = (wavelength_nm - kSkinWavelengthsNm.min) / kStepNm;
  const auto index = std::min(static_cast<std::size_t>(at), kEntries - 2);
  const double log_extinction = std::lerp(std::log(extinction[index]),
                                          std::log(extinction[index + 1]),
                                          at - static_cast<double>(index));
  return std::numbers::ln10 * std::exp(log_extinction) * kGramsPerLitre /
         kGramsPerMole / kMmPerCm;
}

}  // namespace

double EumelaninAbsorption(double wavelength_nm) {
  return 6.6e10 * std::pow(wavelength_nm, -3.33);
}

double PheomelaninAbsorption(double wavelength_nm) {
  return 2.9e14 * std::pow(wavelength_nm, -4.75);
}

double BaselineAbsorption(double wavelength_nm) {
  return 0.0244 + 8.53 * std::exp(-(wavelength_nm - 154) / 66.2);
}

double OxyHaemoglobinAbsorption(double wavelength_nm) {
  return BloodAbsorption(kOxy, wavelength_nm);
}

double DeoxyHaemoglobinAbsorption(double wavelength_nm) {
  return BloodAbsorption(kDeoxy, wavelength_nm);
}

double EpidermisAbsorption(const SkinModel& skin, double wavelength_nm) {
  const double melanin = std::lerp(PheomelaninAbsorption(wavelength_nm),
                                   EumelaninAbsorption(wavelength_nm),
                                   skin.eumelanin_share);
  return std::lerp(BaselineAbsorption(wavelength_nm), melanin, skin.melanin_fraction);
}

double DermisAbsorption(const SkinModel& skin, double wavelength_nm) {
  const double blood = std::lerp(DeoxyHaemoglobinAbsorption(wavelength_nm),
                                 OxyHaemoglobinAbsorption(wavelength_nm),
                                 skin.oxygenation);
  return std::lerp(BaselineAbsorption(wavelength_nm), blood, skin.haemoglobin_fraction);
}

double EpidermisReducedScattering(double wavelength_nm) {
  return 14.74 * std::pow(wavelength_nm, -0.22) + 2.2e11 * std::pow(wavelength_nm, -4);
}

double DermisReducedScattering(double wavelength_nm) {
  return 0.5 * EpidermisReducedScattering(wavelength_nm);
}

}  // namespace nacre::rigs
