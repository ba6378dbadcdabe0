#include "core/fresnel.h"
#include "render/bsdf/bsdfs.h"
#include "render/bsdf/fresnel.h"
#include "render/warp.h"

namespace nacre::render {
namespace {

class LocalTranslucency final : public Bsdf {
 public:
  LocalTranslucency(BsdfPtr coat, TexturePtr albedo, float eta)
      : coat_(std::move(coat)),
        albedo_(std::move(albedo)),
        eta_(eta),
        scale_(static_cast<float>(1 / ExitNormalization(static_cast<double>(eta))) *
               kInvPi) {}

  BsdfValue Evaluate(Vec3 wo, Vec3 wi, Vec2 uv) const override {
    const Color albedo = albedo_->At(uv);
    const float share = Share(albedo);
    BsdfValue sum;
    if (share < 1) {
      sum = coat_->Evaluate(wo, wi, uv);
      sum.pdf *= 1 - share;
    }
    if (share > 0 && wo.z > 0 && wi.z > 0) {
      const float transmitted =
          (1 - FresnelDielectric(wo.z, eta_)) * (1 - FresnelDielectric(wi.z, eta_));
      sum.value += albedo * (transmitted * scale_ * wi.z);
      sum.pdf += share * CosineHemispherePdf(wi.z);
    }
    return sum;
  }

  BsdfSample Sample(Vec3 wo, Vec2 uv, float u_lobe, Vec2 u) const override {
    const float share = Share(albedo_->At(uv));
    BsdfSample sample;
    if (u_lobe >= share) {
      sample = coat_->Sample(wo, uv, (u_lobe - share) / (1 - share), u);
      if (share == 0) {
        return sample;
      }
      if (sample.delta) {
        sample.weight *= 1 / (1 - share);
        sample.pdf *= 1 - share;
        return sample;
      }
      if (!(sample.pdf > 0)) {
        return {};
      }
    } else if (wo.z > 0) {
      sample.wi = SquareToCosineHemisphere(u);
    } else {
      return {};
    }
    const BsdfValue value = Evaluate(wo, sample.wi, uv);
    if (!(value.pdf > 0)) {
      return {};
    }
    sample.weight = value.value / value.pdf;
    sample.pdf = value.pdf;
    return sample;
  }

  bool Transmits() const override { return coat_ != nullptr && coat_->Transmits(); }

 private:
  /// How often the diffuse lobe is sampled.
  float Share(Color albedo) const {
    return coat_ == nullptr ? 1.0F : MaxComponent(albedo) > 0 ? 0.5F : 0.0F;
  }

  BsdfPtr coat_;
  TexturePtr albedo_;
  float eta_;
  float scale_;
};

}  // namespace

BsdfPtr MakeLocalTranslucency(BsdfPtr coat, TexturePtr albedo, float eta) {
  return std::make_shared<LocalTranslucency>(std::move(coat), std::move(albedo), eta);
}

}  // namespace nacre::render
