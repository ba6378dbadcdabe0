#include "render/bsdf/bsdfs.h"
#include "render/warp.h"

namespace nacre::render {
namespace {

class Diffuse : public Bsdf {
 public:
  explicit Diffuse(TexturePtr reflectance) : reflectance_(std::move(reflectance)) {}

  BsdfValue Evaluate(Vec3 wo, Vec3 wi, Vec2 uv) const override {
    if (wo.z <= 0 || wi.z <= 0) {
      return {};
    }
    return {reflectance_->At(uv) * (kInvPi * wi.z), CosineHemispherePdf(wi.z)};
  }

  BsdfSample Sample(Vec3 wo, Vec2 uv, float, Vec2 u) const override {
    if (wo.z <= 0) {
      return {};
    }
    const Vec3 wi = SquareToCosineHemisphere(u);
    return {wi, reflectance_->At(uv), CosineHemispherePdf(wi.z), false};
  }

 private:
  TexturePtr reflectance_;
};

class TwoSided : public Bsdf {
 public:
  explicit TwoSided(BsdfPtr front) : front_(std::move(front)) {}

  BsdfValue Evaluate(Vec3 wo, Vec3 wi, Vec2 uv) const override {
    return wo.z > 0 ? front_->Evaluate(wo, wi, uv)
                    : front_->Evaluate(Mirror(wo), Mirror(wi), uv);
  }

  BsdfSample Sample(Vec3 wo, Vec2 uv, float u_lobe, Vec2 u) const override {
    if (wo.z > 0) {
      return front_->Sample(wo, uv, u_lobe, u);
    }
    BsdfSample sample = front_->Sample(Mirror(wo), uv, u_lobe, u);
    sample.wi = Mirror(sample.wi);
    return sample;
  }

  bool IsDelta() const override { return front_->IsDelta(); }
  bool Transmits() const override { return front_->Transmits(); }

 private:
  static Vec3 Mirror(Vec3 w) { return {w.x, w.y, -w.z}; }
  BsdfPtr front_;
};

}  // namespace

BsdfPtr MakeDiffuse(TexturePtr reflectance) {
  return std::make_shared<Diffuse>(std::move(reflectance));
}

BsdfPtr MakeTwoSided(BsdfPtr front) {
  return std::make_shared<TwoSided>(std::move(front));
}

}  // namespace nacre::render
