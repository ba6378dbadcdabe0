#include "render/bsdf/albedo_table.h"
#include "render/bsdf/bsdfs.h"
#include "render/bsdf/fresnel.h"
#include "render/warp.h"

#include <cmath>

namespace nacre::render {
namespace {

// Directions on both sides of facets with wo above them; `eta` is the index below over
// the one above.
class Interface {
 public:
  Interface(const Microfacet& facets, float eta)
      : facets_(facets), eta_(eta), albedo_([this](Vec3 wo, Vec2 u) {
          const Vec3 m = facets_.SampleNormal(wo, u);
          const float reflected = FresnelDielectric(Cosine(wo, m), eta_);
          return reflected * Ratio(wo, m, Reflect(wo, m)) +
                 (reflected < 1 ? (1 - reflected) * Ratio(wo, m, Refract(wo, m)) : 0);
        }) {}

  float eta() const { return eta_; }
  /// Of what one bounce reflects and transmits.
  const AlbedoTable& albedo() const { return albedo_; }

  /// ∫₀¹ 2 (1 − F(μ)) μ dμ.
  float MeanTransmittance() const {
    constexpr int kPanels = 1024;
    double sum = 0;
    for (int i = 0; i < kPanels; ++i) {
      const float mu = (static_cast<float>(i) + 0.5F) / kPanels;
      sum += static_cast<double>((1 - FresnelDielectric(mu, eta_)) * 2 * mu / kPanels);
    }
    return static_cast<float>(sum);
  }

  /// False if a facet faces away or its light would meet others: no direction.
  bool Sample(Vec3 wo, float u_lobe, Vec2 u, Vec3& wi) const {
    const Vec3 m = facets_.SampleNormal(wo, u);
    const bool reflects = u_lobe < FresnelDielectric(Cosine(wo, m), eta_);
    wi = reflects ? Reflect(wo, m) : Refract(wo, m);
    return Dot(wo, m) > 0 && (reflects ? wi.z > 0 : wi.z < 0);
  }

  /// Flux a steradian and its density, of one bounce; [Walter07, Eqs. 20, 21, 38].
  void Evaluate(Vec3 wo, Vec3 wi, float& flux, float& pdf) const {
    flux = 0;
    pdf = 0;
    const bool reflects = wi.z > 0;
    Vec3 m = reflects ? wo + wi : -(wo + wi * eta_);
    const float length = Length(m);
    if (!(length > 0)) {
      return;
    }
    m = m / (m.z > 0 ? length : -length);
    const float cos_om = Dot(wo, m);
    const float cos_im = Dot(wi, m);
    if (cos_om <= 0 || cos_im * wi.z <= 0) {
      return;
    }
    const float reflected = FresnelDielectric(std::min(1.0F, cos_om), eta_);
    const float towards = cos_om + eta_ * cos_im;
    const float jacobian =
        reflects ? 1 / (4 * cos_om) : eta_ * eta_ * -cos_im / (towards * towards);
    pdf = (reflects ? reflected : 1 - reflected) * facets_.NormalPdf(wo, m) * jacobian;
    flux = pdf * Ratio(wo, m, wi);
  }

 private:
  static float Cosine(Vec3 wo, Vec3 m) { return std::clamp(Dot(wo, m), 0.0F, 1.0F); }
  static Vec3 Reflect(Vec3 wo, Vec3 m) { return m * (2 * Dot(wo, m)) - wo; }
  Vec3 Refract(Vec3 wo, Vec3 m) const {
    const float cos_o = Cosine(wo, m);
    const float sin2_t = (1 - cos_o * cos_o) / (eta_ * eta_);
    return (m * cos_o - wo) / eta_ - m * std::sqrt(std::max(0.0F, 1 - sin2_t));
  }
  // D G |wo·m| / (wo.z pdf(m)): how much more light takes the way over m than its
  // samples. 0 if facets hide it.
  float Ratio(Vec3 wo, Vec3 m, Vec3 wi) const {
    const bool is_seen = Dot(wo, m) > 0 && Dot(wi, m) * wi.z > 0;
    const float pdf = is_seen ? facets_.NormalPdf(wo, m) : 0;
    if (!(pdf > 0)) {
      return 0;
    }
    const float shadowing =
        wi.z > 0 ? facets_.G2(wo.z, wi.z) : facets_.G1(wo.z) * facets_.G1(-wi.z);
    return facets_.D(m) * shadowing * Dot(wo, m) / (wo.z * pdf);
  }

  Microfacet facets_;
  float eta_;
  AlbedoTable albedo_;
};

// One bounce, and what further ones bring: on both sides a lobe of the shape
// (1 − E(ω_o)) (1 − E(ω_i)), the share that crosses such that flux is reciprocal.
class RoughDielectric : public Bsdf {
 public:
  RoughDielectric(const DielectricParameters& parameters, const Microfacet& facets)
      : p_(parameters),
        outside_(facets, parameters.eta),
        inside_(facets, 1 / parameters.eta) {
    const float lost_outside = 1 - outside_.albedo().Mean();
    const float lost_inside = 1 - inside_.albedo().Mean();
    const float most = std::max(lost_outside, lost_inside);
    if (most > 1e-6F) {
      crosses_inwards_ = outside_.MeanTransmittance() * lost_inside / most;
      crosses_outwards_ = inside_.MeanTransmittance() * lost_outside / most;
    }
  }

  bool Transmits() const override { return true; }

  BsdfValue Evaluate(Vec3 wo, Vec3 wi, Vec2 uv) const override {
    if (wo.z == 0 || wi.z == 0) {
      return {};
    }
    // Seen from the inside, everything is upside down.
    const bool is_outside = wo.z > 0;
    if (!is_outside) {
      wo.z = -wo.z;
      wi.z = -wi.z;
    }
    const Interface& here = is_outside ? outside_ : inside_;
    const Interface& there = is_outside ? inside_ : outside_;
    const bool reflects = wi.z > 0;
    float flux = 0;
    float pdf = 0;
    here.Evaluate(wo, wi, flux, pdf);

    const float first = here.albedo()(wo.z);
    const AlbedoTable& albedo_i = reflects ? here.albedo() : there.albedo();
    const float crosses = is_outside ? crosses_inwards_ : crosses_outwards_;
    const float share = reflects ? 1 - crosses : crosses;
    const float cos_i = std::abs(wi.z);
    const float lost = 1 - albedo_i.Mean();
    if (lost > 1e-6F) {
      flux += share * (1 - first) * (1 - albedo_i(cos_i)) * kInvPi / lost * cos_i;
    }
    pdf = first * pdf + (1 - first) * share * CosineHemispherePdf(cos_i);
    // Radiance shrinks with the square of the index on the way out of the dense side.
    const Color tint =
        reflects ? p_.specular_reflectance->At(uv)
                 : p_.specular_transmittance->At(uv) / (here.eta() * here.eta());
    return {tint * flux, pdf};
  }

  BsdfSample Sample(Vec3 wo, Vec2 uv, float u_lobe, Vec2 u) const override {
    if (wo.z == 0) {
      return {};
    }
    const bool is_outside = wo.z > 0;
    const Interface& here = is_outside ? outside_ : inside_;
    const Vec3 up{wo.x, wo.y, std::abs(wo.z)};
    const float first = here.albedo()(up.z);
    Vec3 wi;
    if (u_lobe < first) {
      if (!here.Sample(up, u_lobe / first, u, wi)) {
        return {};
      }
    } else {
      const float rest = (u_lobe - first) / (1 - first);
      wi = SquareToCosineHemisphere(u);
      wi.z = rest < (is_outside ? crosses_inwards_ : crosses_outwards_) ? -wi.z : wi.z;
    }
    const bool reflects = wi.z > 0;
    wi.z = is_outside ? wi.z : -wi.z;
    const BsdfValue value = Evaluate(wo, wi, uv);
    return value.pdf > 0 ? BsdfSample{wi,
                                      value.value / value.pdf,
                                      value.pdf,
                                      false,
                                      reflects ? 1 : here.eta()}
                         : BsdfSample{};
  }

 private:
  DielectricParameters p_;
  Interface outside_;
  Interface inside_;
  float crosses_inwards_ = 0;  ///< of the light after the first bounce
  float crosses_outwards_ = 0;
};

}  // namespace

BsdfPtr MakeRoughDielectric(const DielectricParameters& parameters,
                            const Microfacet& facets) {
  return std::make_shared<RoughDielectric>(parameters, facets);
}

}  // namespace nacre::render
