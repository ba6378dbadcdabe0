#include "render/bsdf/albedo_table.h"
#include "render/bsdf/bsdfs.h"
#include "render/bsdf/fresnel.h"
#include "render/warp.h"

namespace nacre::render {
namespace {

Color FacetReflectance(const ConductorParameters& p, float cosine) {
  return p.perfect ? Color{1, 1, 1}
                   : FresnelConductor(std::min(cosine, 1.0F), p.eta, p.k);
}

class Conductor : public Bsdf {
 public:
  explicit Conductor(const ConductorParameters& parameters) : p_(parameters) {}

  BsdfValue Evaluate(Vec3, Vec3, Vec2) const override { return {}; }

  BsdfSample Sample(Vec3 wo, Vec2 uv, float, Vec2) const override {
    if (wo.z <= 0) {
      return {};
    }
    return {{-wo.x, -wo.y, wo.z},
            p_.specular_reflectance->At(uv) * FacetReflectance(p_, wo.z),
            1,
            true};
  }

  bool IsDelta() const override { return true; }

 private:
  ConductorParameters p_;
};

// f = F D G / (4 cos cos) + what further bounces between facets bring: a lobe of the
// shape (1 − E(ω_o)) (1 − E(ω_i)), E the albedo of the first bounce without Fresnel,
// coloured by the mean reflectance once a bounce.
class RoughConductor : public Bsdf {
 public:
  RoughConductor(const ConductorParameters& parameters, const Microfacet& facets)
      : p_(parameters), facets_(facets), albedo_(facets, [](float) { return 1.0F; }) {
    const Color mean = MeanReflectance();
    const float lost = 1 - albedo_.Mean();
    const auto further = [&](float f) {
      return f * f * albedo_.Mean() / (1 - f * lost);
    };
    further_ = {further(mean.x), further(mean.y), further(mean.z)};
    inv_pi_lost_ = lost > 1e-6F ? kInvPi / lost : 0;
  }

  BsdfValue Evaluate(Vec3 wo, Vec3 wi, Vec2 uv) const override {
    if (wo.z <= 0 || wi.z <= 0) {
      return {};
    }
    const Vec3 half = wo + wi;
    const Vec3 m = half / Length(half);
    const float cos_om = Dot(wo, m);
    const float d = facets_.D(m);
    const float first = albedo_(wo.z);
    BsdfValue result;
    if (d > 0 && cos_om > 0) {
      result.value =
          FacetReflectance(p_, cos_om) * (d * facets_.G2(wo.z, wi.z) / (4 * wo.z));
      result.pdf = first * facets_.NormalPdf(wo, m) / (4 * cos_om);
    }
    result.value +=
        further_ * ((1 - first) * (1 - albedo_(wi.z)) * inv_pi_lost_ * wi.z);
    result.pdf += (1 - first) * CosineHemispherePdf(wi.z);
    result.value *= p_.specular_reflectance->At(uv);
    return result;
  }

  BsdfSample Sample(Vec3 wo, Vec2 uv, float u_lobe, Vec2 u) const override {
    if (wo.z <= 0) {
      return {};
    }
    Vec3 wi;
    if (u_lobe < albedo_(wo.z)) {
      const Vec3 m = facets_.SampleNormal(wo, u);
      wi = m * (2 * Dot(wo, m)) - wo;
    } else {
      wi = SquareToCosineHemisphere(u);
    }
    const BsdfValue value = Evaluate(wo, wi, uv);
    return value.pdf > 0 ? BsdfSample{wi, value.value / value.pdf, value.pdf, false}
                         : BsdfSample{};
  }

 private:
  // ∫₀¹ 2 F(μ) μ dμ.
  Color MeanReflectance() const {
    constexpr int kPanels = 1024;
    Color sum;
    for (int i = 0; i < kPanels; ++i) {
      const float mu = (static_cast<float>(i) + 0.5F) / kPanels;
      sum += FacetReflectance(p_, mu) * (2 * mu / kPanels);
    }
    return sum;
  }

  ConductorParameters p_;
  Microfacet facets_;
  AlbedoTable albedo_;
  Color further_;
  float inv_pi_lost_ = 0;
};

}  // namespace

BsdfPtr MakeConductor(const ConductorParameters& parameters) {
  return std::make_shared<Conductor>(parameters);
}

BsdfPtr MakeRoughConductor(const ConductorParameters& parameters,
                           const Microfacet& facets) {
  return std::make_shared<RoughConductor>(parameters, facets);
}

}  // namespace nacre::render
