#include "render/bsdf/albedo_table.h"
#include "render/bsdf/bsdfs.h"
#include "render/bsdf/diffuse_base.h"
#include "render/bsdf/fresnel.h"
#include "render/warp.h"

namespace nacre::render {
namespace {

class RoughPlastic : public Bsdf {
 public:
  RoughPlastic(const PlasticParameters& parameters, const Microfacet& facets)
      : p_(parameters),
        facets_(facets),
        albedo_(
            facets,
            [eta = p_.eta](float cosine) { return FresnelDielectric(cosine, eta); }),
        base_(DiffuseBase::Make(p_.eta, 1 - albedo_.Mean(), p_.nonlinear)) {}

  BsdfValue Evaluate(Vec3 wo, Vec3 wi, Vec2 uv) const override {
    if (wo.z <= 0 || wi.z <= 0) {
      return {};
    }
    return Evaluate(Lobes(wo, uv), wo, wi);
  }

  BsdfSample Sample(Vec3 wo, Vec2 uv, float u_lobe, Vec2 u) const override {
    if (wo.z <= 0) {
      return {};
    }
    const LobeWeights lobes = Lobes(wo, uv);
    Vec3 wi;
    if (u_lobe < lobes.specular_probability) {
      const Vec3 m = facets_.SampleNormal(wo, u);
      wi = m * (2 * Dot(wo, m)) - wo;
    } else {
      wi = SquareToCosineHemisphere(u);
    }
    if (wi.z <= 0) {
      return {};
    }
    const BsdfValue value = Evaluate(lobes, wo, wi);
    return value.pdf > 0 ? BsdfSample{wi, value.value / value.pdf, value.pdf, false}
                         : BsdfSample{};
  }

 private:
  struct LobeWeights {
    Color specular;
    Color diffuse;
    float transmitted_o;
    float specular_probability;
  };

  LobeWeights Lobes(Vec3 wo, Vec2 uv) const {
    const float reflected = albedo_(wo.z);
    LobeWeights lobes{p_.specular_reflectance->At(uv),
                      p_.diffuse_reflectance->At(uv),
                      1 - reflected,
                      1};
    const float s = reflected * Luminance(lobes.specular);
    const float d = lobes.transmitted_o * Luminance(lobes.diffuse);
    lobes.specular_probability = s + d > 0 ? s / (s + d) : 1.0F;
    return lobes;
  }

  BsdfValue Evaluate(const LobeWeights& lobes, Vec3 wo, Vec3 wi) const {
    BsdfValue result;
    const Vec3 half = wo + wi;
    const Vec3 m = half / Length(half);
    const float cos_om = Dot(wo, m);
    const float d = facets_.D(m);
    if (d > 0 && cos_om > 0) {
      const float reflected = FresnelDielectric(std::min(cos_om, 1.0F), p_.eta);
      result.value =
          lobes.specular * (reflected * d * facets_.G2(wo.z, wi.z) / (4 * wo.z));
      result.pdf = lobes.specular_probability * facets_.NormalPdf(wo, m) / (4 * cos_om);
    }
    if (lobes.specular_probability < 1) {
      const float transmitted_i = 1 - albedo_(wi.z);
      result.value += base_.Reflectance(lobes.diffuse) *
                      (lobes.transmitted_o * transmitted_i * kInvPi * wi.z);
      result.pdf += (1 - lobes.specular_probability) * CosineHemispherePdf(wi.z);
    }
    return result;
  }

  PlasticParameters p_;
  Microfacet facets_;
  AlbedoTable albedo_;
  DiffuseBase base_;
};

}  // namespace

BsdfPtr MakeRoughPlastic(const PlasticParameters& parameters,
                         const Microfacet& facets) {
  return std::make_shared<RoughPlastic>(parameters, facets);
}

}  // namespace nacre::render
