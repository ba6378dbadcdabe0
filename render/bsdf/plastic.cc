#include "core/fresnel.h"
#include "render/bsdf/bsdfs.h"
#include "render/bsdf/diffuse_base.h"
#include "render/bsdf/fresnel.h"
#include "render/warp.h"

namespace nacre::render {
namespace {

class Plastic : public Bsdf {
 public:
  explicit Plastic(const PlasticParameters& parameters)
      : p_(parameters),
        base_(DiffuseBase::Make(
            p_.eta,
            static_cast<float>(1 -
                               DiffuseFresnelReflectance(static_cast<double>(p_.eta))),
            p_.nonlinear)) {}

  BsdfValue Evaluate(Vec3 wo, Vec3 wi, Vec2 uv) const override {
    if (wo.z <= 0 || wi.z <= 0) {
      return {};
    }
    const float transmitted_o = 1 - FresnelDielectric(wo.z, p_.eta);
    const float transmitted_i = 1 - FresnelDielectric(wi.z, p_.eta);
    const Color f = base_.Reflectance(p_.diffuse_reflectance->At(uv)) *
                    (transmitted_o * transmitted_i * kInvPi);
    return {f * wi.z, (1 - SpecularProbability(wo, uv)) * CosineHemispherePdf(wi.z)};
  }

  BsdfSample Sample(Vec3 wo, Vec2 uv, float u_lobe, Vec2 u) const override {
    if (wo.z <= 0) {
      return {};
    }
    const float specular = SpecularProbability(wo, uv);
    if (u_lobe < specular) {
      const Color reflected =
          p_.specular_reflectance->At(uv) * FresnelDielectric(wo.z, p_.eta);
      return {{-wo.x, -wo.y, wo.z}, reflected / specular, specular, true};
    }
    const Vec3 wi = SquareToCosineHemisphere(u);
    const BsdfValue value = Evaluate(wo, wi, uv);
    return value.pdf > 0 ? BsdfSample{wi, value.value / value.pdf, value.pdf, false}
                         : BsdfSample{};
  }

 private:
  float SpecularProbability(Vec3 wo, Vec2 uv) const {
    const float reflected = FresnelDielectric(wo.z, p_.eta);
    const float s = reflected * Luminance(p_.specular_reflectance->At(uv));
    const float d = (1 - reflected) * Luminance(p_.diffuse_reflectance->At(uv));
    return s + d > 0 ? s / (s + d) : 1.0F;
  }

  PlasticParameters p_;
  DiffuseBase base_;
};

}  // namespace

BsdfPtr MakePlastic(const PlasticParameters& parameters) {
  return std::make_shared<Plastic>(parameters);
}

}  // namespace nacre::render
