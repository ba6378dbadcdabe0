#include "render/bsdf/albedo_table.h"

#include "render/sampler.h"

#include <algorithm>
#include <cmath>

namespace nacre::render {
namespace {

constexpr int kNodes = 64;
constexpr std::uint32_t kSamples = 4096;

// E changes fastest at grazing angles: node k is at μ = (k / (n − 1))².
float NodeCosine(int k) {
  const float t = static_cast<float>(k) / (kNodes - 1);
  return std::max(1e-4F, t * t);
}

float Albedo(const std::function<float(Vec3 wo, Vec2 u)>& weight, float cos_o) {
  const Vec3 wo{std::sqrt(std::max(0.0F, 1 - cos_o * cos_o)), 0, cos_o};
  double sum = 0;
  for (std::uint32_t i = 0; i < kSamples; ++i) {
    Sampler sampler(0, i);
    sum += static_cast<double>(weight(wo, sampler.Next2D()));
  }
  return static_cast<float>(std::min(1.0, sum / kSamples));
}

float ReflectedWeight(const Microfacet& facets,
                      const std::function<float(float)>& reflectance,
                      Vec3 wo,
                      Vec2 u) {
  const Vec3 m = facets.SampleNormal(wo, u);
  const float cos_om = Dot(wo, m);
  const float cos_i = 2 * cos_om * m.z - wo.z;
  if (cos_om <= 0 || cos_i <= 0) {
    return 0;
  }
  const float pdf = facets.NormalPdf(wo, m) / (4 * cos_om);
  const float f_cos = facets.D(m) * facets.G2(wo.z, cos_i) / (4 * wo.z);
  return pdf > 0 ? reflectance(std::min(cos_om, 1.0F)) * f_cos / pdf : 0;
}

}  // namespace

AlbedoTable::AlbedoTable(const Microfacet& facets,
                         const std::function<float(float)>& reflectance)
    : AlbedoTable([&](Vec3 wo, Vec2 u) {
        return ReflectedWeight(facets, reflectance, wo, u);
      }) {}

AlbedoTable::AlbedoTable(const std::function<float(Vec3 wo, Vec2 u)>& weight)
    : values_(kNodes) {
  for (int k = 0; k < kNodes; ++k) {
    values_[static_cast<std::size_t>(k)] = Albedo(weight, NodeCosine(k));
  }
  constexpr int kPanels = 4096;
  double sum = 0;
  for (int i = 0; i < kPanels; ++i) {
    const float mu = (static_cast<float>(i) + 0.5F) / kPanels;
    sum += static_cast<double>(2 * mu * (*this)(mu));
  }
  mean_ = static_cast<float>(sum / kPanels);
}

float AlbedoTable::operator()(float cos_o) const {
  const float x = std::sqrt(std::clamp(cos_o, 0.0F, 1.0F)) * (kNodes - 1);
  const int k = std::min(static_cast<int>(x), kNodes - 2);
  const float t = x - static_cast<float>(k);
  const auto i = static_cast<std::size_t>(k);
  return values_[i] + t * (values_[i + 1] - values_[i]);
}

}  // namespace nacre::render
