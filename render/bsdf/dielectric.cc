#include "render/bsdf/bsdfs.h"
#include "render/bsdf/fresnel.h"

namespace nacre::render {
namespace {

class Dielectric : public Bsdf {
 public:
  explicit Dielectric(const DielectricParameters& parameters) : p_(parameters) {}

  BsdfValue Evaluate(Vec3, Vec3, Vec2) const override { return {}; }

  BsdfSample Sample(Vec3 wo, Vec2 uv, float u_lobe, Vec2) const override {
    const float cos_o = std::abs(wo.z);
    const float eta = wo.z > 0 ? p_.eta : 1 / p_.eta;  // other side / this side
    const float reflected = FresnelDielectric(cos_o, eta);
    if (u_lobe < reflected) {
      return {{-wo.x, -wo.y, wo.z}, p_.specular_reflectance->At(uv), reflected, true};
    }
    const float sin2_t = (1 - cos_o * cos_o) / (eta * eta);
    const float cos_t = std::sqrt(std::max(0.0F, 1 - sin2_t));
    const Vec3 wi{-wo.x / eta, -wo.y / eta, wo.z > 0 ? -cos_t : cos_t};
    // Radiance shrinks with the square of the index on the way out of the dense side.
    return {
        wi, p_.specular_transmittance->At(uv) / (eta * eta), 1 - reflected, true, eta};
  }

  bool IsDelta() const override { return true; }

 private:
  DielectricParameters p_;
};

}  // namespace

BsdfPtr MakeDielectric(const DielectricParameters& parameters) {
  return std::make_shared<Dielectric>(parameters);
}

}  // namespace nacre::render
