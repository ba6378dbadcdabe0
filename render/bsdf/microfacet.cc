#include "render/bsdf/microfacet.h"

#include "render/warp.h"

#include <cmath>

namespace nacre::render {

float Microfacet::D(Vec3 m) const {
  if (m.z <= 0) {
    return 0;
  }
  const float cos2 = m.z * m.z;
  const float alpha2 = alpha * alpha;
  if (kind == Kind::kGgx) {
    // 1 + cos² (α² − 1), rearranged to stay accurate for small α.
    const float t = cos2 * alpha2 + m.x * m.x + m.y * m.y;
    return alpha2 / (kPi * t * t);
  }
  const float tan2 = (m.x * m.x + m.y * m.y) / cos2;
  return std::exp(-tan2 / alpha2) / (kPi * alpha2 * cos2 * cos2);
}

float Microfacet::Lambda(float cos_theta) const {
  const float cos2 = cos_theta * cos_theta;
  const float tan2 = std::max(0.0F, 1 - cos2) / std::max(cos2, 1e-12F);
  if (kind == Kind::kGgx) {
    return 0.5F * (std::sqrt(1 + alpha * alpha * tan2) - 1);
  }
  if (tan2 == 0) {
    return 0;
  }
  const float a = 1 / (alpha * std::sqrt(tan2));
  const float sqrt_pi = std::sqrt(kPi);
  return 0.5F * (std::erf(a) - 1 + std::exp(-a * a) / (a * sqrt_pi));
}

Vec3 Microfacet::SampleNormal(Vec3 wo, Vec2 u) const {
  if (kind == Kind::kGgx) {
    // Seen from the stretched configuration the visible facets are a spherical cap.
    const Vec3 stretched = Normalized(Vec3{alpha * wo.x, alpha * wo.y, wo.z});
    const float phi = 2 * kPi * u.x;
    const float z = (1 - u.y) * (1 + stretched.z) - stretched.z;
    const float r = std::sqrt(std::max(0.0F, 1 - z * z));
    const Vec3 half = Vec3{r * std::cos(phi), r * std::sin(phi), z} + stretched;
    return Normalized(Vec3{alpha * half.x, alpha * half.y, std::max(1e-9F, half.z)});
  }
  const float tan2 = -alpha * alpha * std::log(std::max(1e-12F, 1 - u.y));
  const float cos_theta = 1 / std::sqrt(1 + tan2);
  const float sin_theta = std::sqrt(tan2) * cos_theta;
  const float phi = 2 * kPi * u.x;
  return {sin_theta * std::cos(phi), sin_theta * std::sin(phi), cos_theta};
}

float Microfacet::NormalPdf(Vec3 wo, Vec3 m) const {
  if (kind == Kind::kGgx) {
    return G1(wo.z) * std::max(0.0F, Dot(wo, m)) * D(m) / wo.z;
  }
  return D(m) * m.z;
}

}  // namespace nacre::render
