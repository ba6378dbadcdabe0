#pragma once

#include "core/options.h"

namespace nacre::rigs {

/// What colours skin, after Donner and Jensen's two-layer model [Donner06].
struct SkinModel {
  double melanin_fraction = 0.05;  ///< C_m, of the epidermis' volume
  double eumelanin_share = 0.7;    ///< β_m; the rest of the melanin is pheomelanin
  double haemoglobin_fraction =
      0.02;                    ///< C_h, whole blood's part of the dermis' volume
  double oxygenation = 0.75;   ///< γ, of the haemoglobin
  double epidermis_mm = 0.25;  ///< thickness
  double epidermis_eta = 1.4;
  double dermis_eta = 1.38;
  double g = 0.8;  ///< of both; only σ_s' is known, σ_s = σ_s' / (1 − g)

  template <class Self, class Visitor>
  static void Visit(Self& self, Visitor&& visit) {
    visit("melanin_fraction", self.melanin_fraction, Range{0, 1}, "");
    visit("eumelanin_share", self.eumelanin_share, Range{0, 1}, "");
    visit("haemoglobin_fraction", self.haemoglobin_fraction, Range{0, 1}, "");
    visit("oxygenation", self.oxygenation, Range{0, 1}, "");
    visit("epidermis_mm", self.epidermis_mm, Range{1e-3, 10}, "");
    visit("epidermis_eta", self.epidermis_eta, Range{1, 4}, "");
    visit("dermis_eta", self.dermis_eta, Range{1, 4}, "");
    visit("g", self.g, Range{-0.999, 0.999}, "");
  }
};

/// The wavelengths the haemoglobin table covers.
inline constexpr Range kSkinWavelengthsNm{400, 720};

/// The laws, all mm⁻¹, λ in nm.
/// Melanins [Jacques98] in [Donner06, sec. 4]: 6.6·10¹⁰ λ^−3.33 and 2.9·10¹⁴ λ^−4.75.
double EumelaninAbsorption(double wavelength_nm);
double PheomelaninAbsorption(double wavelength_nm);
/// Bloodless, unpigmented tissue [Jacques98]: 0.0244 + 8.53 e^(−(λ − 154) / 66.2).
double BaselineAbsorption(double wavelength_nm);
/// Whole blood of 150 g/l, ln 10 · ε(λ) · 150 / 64 500 [Prahl99], ε interpolated in its
/// logarithm between multiples of 10 nm. Throws LogicError outside kSkinWavelengthsNm.
double OxyHaemoglobinAbsorption(double wavelength_nm);
double DeoxyHaemoglobinAbsorption(double wavelength_nm);

/// σ_a = C_m (β_m σ_em + (1 − β_m) σ_pm) + (1 − C_m) σ_base.
double EpidermisAbsorption(const SkinModel& skin, double wavelength_nm);
/// σ_a = C_h (γ σ_oxy + (1 − γ) σ_deoxy) + (1 − C_h) σ_base.
double DermisAbsorption(const SkinModel& skin, double wavelength_nm);
/// σ_s' = 14.74 λ^−0.22 + 2.2·10¹¹ λ^−4 in the epidermis, half of it in the dermis.
double EpidermisReducedScattering(double wavelength_nm);
double DermisReducedScattering(double wavelength_nm);

}  // namespace nacre::rigs
