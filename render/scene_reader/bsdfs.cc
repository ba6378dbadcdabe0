#include "render/scene_reader/objects.h"

#include <array>

namespace nacre::render {
namespace {

struct Metal {
  const char* name;
  Color eta;
  Color k;
};

// Complex indices of refraction as linear RGB, averaged from the spectra in the
// handbooks [Palik85].
constexpr std::array<Metal, 5> kMetals = {
    {{"Ag", {0.155F, 0.117F, 0.138F}, {4.828F, 3.122F, 2.147F}},
     {"Al", {1.657F, 0.880F, 0.521F}, {9.224F, 6.270F, 4.837F}},
     {"Au", {0.143F, 0.375F, 1.442F}, {3.983F, 2.386F, 1.603F}},
     {"Cr", {4.370F, 2.917F, 1.655F}, {5.206F, 4.231F, 3.755F}},
     {"Cu", {0.200F, 0.924F, 1.102F}, {3.912F, 2.452F, 2.142F}}}};

float RelativeIndex(Element& element, const char* inside) {
  const double internal = element.RefractiveIndex("intIOR", inside);
  return static_cast<float>(internal / element.RefractiveIndex("extIOR", "air"));
}

Microfacet ReadMicrofacet(Element& element) {
  Microfacet facets;
  const std::string name = element.String("distribution", "beckmann");
  if (name == "ggx") {
    facets.kind = Microfacet::Kind::kGgx;
  } else if (name == "beckmann") {
    facets.kind = Microfacet::Kind::kBeckmann;
  } else {
    element.FailAt(
        "distribution",
        fmt::format(
            "no distribution '{}'{}", name, Suggestion(name, {"beckmann", "ggx"})));
  }
  facets.alpha = static_cast<float>(
      InRange(element, "alpha", element.Float("alpha", 0.1), {1e-4, 4}));
  element.Ignore("sampleVisible", "GGX is sampled by visible facets, Beckmann by all");
  return facets;
}

PlasticParameters ReadPlastic(Element& element) {
  PlasticParameters p;
  p.diffuse_reflectance = element.Reflectance("diffuseReflectance", {0.5F, 0.5F, 0.5F});
  p.specular_reflectance = element.Reflectance("specularReflectance", kWhite);
  p.eta = RelativeIndex(element, "polypropylene");
  p.nonlinear = element.Boolean("nonlinear", false);
  if (p.eta < 1) {
    element.Fail("a coat must have a higher index inside (intIOR) than outside");
  }
  return p;
}

ConductorParameters ReadConductor(Element& element) {
  ConductorParameters p;
  const std::string material = element.String("material", "Cu");
  p.perfect = material == "none";
  if (!p.perfect && !(element.Has("eta") && element.Has("k"))) {
    std::vector<std::string> known = {"none"};
    for (const Metal& metal : kMetals) {
      known.push_back(metal.name);
      if (material == metal.name) {
        p.eta = metal.eta;
        p.k = metal.k;
      }
    }
    if (p.eta == Color{}) {
      element.FailAt(
          "material",
          fmt::format("no metal '{}'{}", material, Suggestion(material, known)));
    }
  }
  p.eta = element.Spectrum("eta", p.eta);
  p.k = element.Spectrum("k", p.k);
  const float outside = static_cast<float>(element.RefractiveIndex("extEta", "air"));
  p.eta = p.eta / outside;
  p.k = p.k / outside;
  p.specular_reflectance = element.Reflectance("specularReflectance", kWhite);
  return p;
}

DielectricParameters ReadDielectric(Element& element) {
  DielectricParameters p;
  p.eta = RelativeIndex(element, "bk7");
  p.specular_reflectance = element.Reflectance("specularReflectance", kWhite);
  p.specular_transmittance = element.Reflectance("specularTransmittance", kWhite);
  return p;
}

BsdfPtr ReadTwoSided(Element& element) {
  std::vector<BsdfPtr> nested;
  for (const Element& child : element.Objects("bsdf")) {
    nested.push_back(ReadBsdf(child));
  }
  for (const Element& ref : element.Objects("ref")) {
    nested.push_back(
        FindById(element.document(), ref.node(), element.document().bsdfs, "bsdf"));
  }
  if (nested.size() != 1) {
    element.Fail(fmt::format("twosided needs one bsdf, not {}", nested.size()));
  }
  return MakeTwoSided(nested.front());
}

BsdfPtr MakeOfType(Element& element, const std::string& type) {
  if (type == "diffuse") {
    // Mitsuba takes both names.
    const bool long_name = element.Has("diffuseReflectance");
    return MakeDiffuse(element.Reflectance(
        long_name ? "diffuseReflectance" : "reflectance", {0.5F, 0.5F, 0.5F}));
  }
  if (type == "plastic") {
    return MakePlastic(ReadPlastic(element));
  }
  if (type == "roughplastic") {
    const PlasticParameters plastic = ReadPlastic(element);
    return MakeRoughPlastic(plastic, ReadMicrofacet(element));
  }
  if (type == "conductor") {
    return MakeConductor(ReadConductor(element));
  }
  if (type == "roughconductor") {
    const ConductorParameters conductor = ReadConductor(element);
    return MakeRoughConductor(conductor, ReadMicrofacet(element));
  }
  if (type == "dielectric") {
    return MakeDielectric(ReadDielectric(element));
  }
  if (type == "roughdielectric") {
    const DielectricParameters dielectric = ReadDielectric(element);
    if (dielectric.eta == 1) {
      element.Fail("facets between equal indices (intIOR, extIOR) don't refract");
    }
    return MakeRoughDielectric(dielectric, ReadMicrofacet(element));
  }
  if (type == "twosided") {
    return ReadTwoSided(element);
  }
  return nullptr;
}

}  // namespace

BsdfPtr ReadBsdf(Element element) {
  BsdfPtr bsdf = MakeOfType(element, element.type());
  if (bsdf == nullptr) {
    UnknownPlugin(element,
                  {"diffuse",
                   "plastic",
                   "roughplastic",
                   "conductor",
                   "roughconductor",
                   "dielectric",
                   "roughdielectric",
                   "twosided"});
    bsdf = MakeDiffuse(MakeConstant({0.5F, 0.5F, 0.5F}));
  } else {
    element.Finish();
  }
  if (!element.id().empty()) {
    element.document().bsdfs[element.id()] = bsdf;
  }
  return bsdf;
}

}  // namespace nacre::render
