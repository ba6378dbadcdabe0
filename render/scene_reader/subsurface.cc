#include "factor/material.h"
#include "render/jensen_media.h"
#include "render/preset_path.h"
#include "render/scene_reader/objects.h"
#include "render/subsurface/models.h"

#include <cmath>

namespace nacre::render {
namespace {

void ReadCommon(Element& element, Translucency& translucency) {
  translucency.mm_per_unit = static_cast<float>(
      InRange(element, "scale", element.Float("scale", 1), {1e-9, 1e9}));
  translucency.indirect = element.Boolean("irrIndirect", true);
  translucency.irradiance_samples = element.Integer("irrSamples", 16);
  InRange(element, "irrSamples", translucency.irradiance_samples, {1, 1 << 20});
  const std::string ours = "the model chooses its accuracy, about 1 %";
  for (const char* name : {"quality", "sampleMultiplier", "dumpIrrtree"}) {
    element.Ignore(name, ours);
  }
}

Color Reduced(Color sigma_s, double g) {
  return sigma_s * static_cast<float>(1 - g);
}

// Coefficients in one of three ways: a medium of Jensen's table, σ_s and σ_a, or σ_t
// and the albedo.
DipoleParameters ReadMedium(Element& element) {
  DipoleParameters p;
  const double g = InRange(element, "g", element.Float("g", 0), {-0.999, 0.999});
  const bool coefficients = element.Has("sigmaS") || element.Has("sigmaA");
  const bool albedo = element.Has("sigmaT") || element.Has("albedo");
  const bool material = element.Has("material");
  if (coefficients + albedo + material != 1) {
    element.Fail(
        "give one of: 'material'; 'sigmaS' and 'sigmaA'; 'sigmaT' and 'albedo'");
  }
  if (material) {
    const std::string name = element.String("material", "");
    const auto medium = FindJensenMedium(name);
    if (!medium) {
      element.FailAt("material",
                     fmt::format("no medium '{}' in the table of Jensen et al. 2001{}",
                                 name,
                                 Suggestion(name, JensenMediumNames())));
    }
    p.sigma_s_prime_per_mm = medium->sigma_s_prime_per_mm;
    p.sigma_a_per_mm = medium->sigma_a_per_mm;
    p.eta = medium->eta;
  } else if (coefficients) {
    p.sigma_s_prime_per_mm = Reduced(element.Spectrum("sigmaS", {0, 0, 0}), g);
    p.sigma_a_per_mm = element.Spectrum("sigmaA", {0, 0, 0});
  } else {
    const Color sigma_t = element.Spectrum("sigmaT", {0, 0, 0});
    const Color a = element.Spectrum("albedo", {0, 0, 0});
    if (MaxComponent(a) > 1) {
      element.FailAt("albedo", "an albedo above 1");
    }
    p.sigma_s_prime_per_mm = Reduced(sigma_t * a, g);
    p.sigma_a_per_mm = sigma_t * (Color{1, 1, 1} - a);
  }
  const double inside = element.Has("intIOR")
                            ? element.RefractiveIndex("intIOR", "water")
                            : static_cast<double>(p.eta);
  p.eta = static_cast<float>(inside / element.RefractiveIndex("extIOR", "vacuum"));
  return p;
}

std::shared_ptr<const SubsurfaceModel> ReadFactored(Element& element,
                                                    Translucency& translucency) {
  translucency.name = element.String("material", "");
  if (translucency.name.empty()) {
    element.Fail("svd needs a <string name=\"material\">: a preset or a *.nacre.exr");
  }
  Document& document = element.document();
  std::filesystem::path path;
  try {
    path = FindPreset(translucency.name, document.folder);
  } catch (const Error& e) {
    element.FailAt("material", e.what());
  }
  document.scene.files.push_back(path);
  return MakeFactored(
      std::make_shared<const factor::Material>(factor::ReadMaterial(path)));
}

}  // namespace

Translucency ReadSubsurface(Element element) {
  Translucency translucency;
  const std::string type = element.type();
  ReadCommon(element, translucency);
  if (type == "dipole") {
    translucency.name = element.String("material", "dipole");
    const DipoleParameters parameters = ReadMedium(element);
    try {
      translucency.model = MakeDipole(parameters);
    } catch (const Error& e) {
      element.Fail(e.what());
    }
  } else if (type == "svd") {
    translucency.model = ReadFactored(element, translucency);
  } else {
    // Even a lenient reader can't guess a material.
    element.Fail(
        fmt::format("no subsurface '{}'{}", type, Suggestion(type, {"dipole", "svd"})));
  }
  element.Finish();
  return translucency;
}

}  // namespace nacre::render
