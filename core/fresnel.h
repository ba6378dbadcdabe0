#pragma once

namespace nacre {

/// Unpolarised Fresnel reflectance of a smooth dielectric. `cos_i` in [0, 1] on the
/// side the light comes from, `eta` = n_other_side / n_this_side > 0. 1 at total
/// reflection.
double FresnelReflectance(double cos_i, double eta);

/// 1 − FresnelReflectance.
double FresnelTransmittance(double cos_i, double eta);

/// The hemispherical average ∫₀¹ 2 F(μ) μ dμ, by quadrature to 1e-9. For light outside
/// a medium of index eta pass eta; for light inside pass 1 / eta: that is Jensen's
/// F_dr, which the usual polynomial only approximates.
double DiffuseFresnelReflectance(double eta);

/// c(η) = 1 − DiffuseFresnelReflectance(η). Exitance M leaves as radiance
/// L_o(ω_o) = M F_t(η, ω_o) / (π c(η)), whose flux over the hemisphere is M again: with
/// the customary 1 / π alone, light would be lost twice at the surface.
double ExitNormalization(double eta);

}  // namespace nacre
