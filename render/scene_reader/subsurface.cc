#include "render/preset_path.h"
#include "render/scene_reader/mapping.h"
#include "render/scene_reader/objects.h"
#include "render/scene_reader/textured_media.h"
#include "render/subsurface/analytic_profiles.h"
#include "render/subsurface/models.h"
#include "render/subsurface/radial_model.h"

#include <algorithm>
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

DipoleParameters ReadDipole(Element& element) {
  DipoleParameters p;
  const double g = InRange(element, "g", element.Float("g", 0), {-0.999, 0.999});
  const Coefficients c = ReadCoefficients(element);
  p.sigma_s_prime_per_mm =
      c.eta ? c.sigma_s * (Color{1, 1, 1} - c.g) : Reduced(c.sigma_s, g);
  p.sigma_a_per_mm = c.sigma_a;
  p.eta = c.eta.value_or(p.eta);
  const double inside = element.Has("intIOR")
                            ? element.RefractiveIndex("intIOR", "water")
                            : static_cast<double>(p.eta);
  p.eta = static_cast<float>(inside / element.RefractiveIndex("extIOR", "vacuum"));
  return p;
}

Medium MediumOf(const DipoleParameters& p, int channel) {
  return {static_cast<double>(p.sigma_a_per_mm[channel]),
          static_cast<double>(p.sigma_s_prime_per_mm[channel]),
          static_cast<double>(p.eta)};
}

// Of a reflectance and a mean free path, as artists know them.
std::shared_ptr<const SubsurfaceModel> ReadNormalizedDiffusion(Element& element) {
  const Color albedo = element.Spectrum("reflectance", {0.5F, 0.5F, 0.5F});
  const Color mean_free_path = element.Spectrum("meanFreePath", {1, 1, 1});
  const auto profile = [&](int c) {
    return MakeNormalizedDiffusion(static_cast<double>(albedo[c]),
                                   static_cast<double>(mean_free_path[c]));
  };
  const double inside =
      element.Has("intIOR") ? element.RefractiveIndex("intIOR", "water") : 1.5;
  const double eta = inside / element.RefractiveIndex("extIOR", "vacuum");
  return MakeRadial({profile(0), profile(1), profile(2)}, static_cast<float>(eta));
}

std::shared_ptr<const SubsurfaceModel> ReadAnalytic(Element& element,
                                                    const std::string& type) {
  if (type == "normalizeddiffusion") {
    return ReadNormalizedDiffusion(element);
  }
  const DipoleParameters p = ReadDipole(element);
  if (type == "dipole") {
    return MakeDipole(p);
  }
  const bool slab = type == "multipole";
  const double thickness_mm = slab ? element.Float("thickness", 1) : 0;
  const auto profile = [&](int c) {
    return slab ? MakeMultipole(MediumOf(p, c), thickness_mm)
                : MakeBetterDipole(MediumOf(p, c));
  };
  return MakeRadial({profile(0), profile(1), profile(2)}, p.eta);
}

std::filesystem::path FindMaterial(Element& element, const std::string& name) {
  std::filesystem::path path;
  try {
    path = FindPreset(name, element.document().folder);
  } catch (const Error& e) {
    element.FailAt("material", e.what());
  }
  // Names lead to the folders of presets, and nowhere else.
  const std::filesystem::path as_path(name);
  const bool climbs = std::find(as_path.begin(), as_path.end(), "..") != as_path.end();
  if (as_path.is_absolute() || climbs) {
    element.document().CheckAllowed(element.node(), path);
  }
  return path;
}

std::shared_ptr<const SubsurfaceModel> ReadMeasured(Element& element,
                                                    const Shape& shape,
                                                    Translucency& translucency) {
  const SampleOnSurface mapping = ReadMapping(element, shape, translucency.mm_per_unit);
  translucency.name = element.String("material", "");
  if (translucency.name.empty()) {
    element.Fail(
        "svd needs a <string name=\"material\">: a preset, a *.nacre.exr or a "
        "*.rd.exr");
  }
  const std::filesystem::path path = FindMaterial(element, translucency.name);
  element.document().scene.files.push_back(path);
  const auto source = path.string().ends_with(".rd.exr")
                          ? OpenDatasetSource(path)
                          : OpenMaterialSource(path, element.document().material_error);
  translucency.core_mm = static_cast<float>(source->core * source->pitch_mm);
  NoteScale(element, shape, translucency, *source, mapping.mapping);
  return MakeMeasured(source, {}, mapping);
}

}  // namespace

void ReadSubsurface(Element element, Shape& shape) {
  Translucency translucency;
  const std::string type = element.type();
  ReadCommon(element, translucency);
  const std::vector<std::string> analytic = {
      "dipole", "betterdipole", "multipole", "normalizeddiffusion"};
  if (type == "svd") {
    translucency.model = ReadMeasured(element, shape, translucency);
  } else if (std::find(analytic.begin(), analytic.end(), type) != analytic.end()) {
    translucency.name = element.String("material", type);
    try {
      if (!ReadTexturedModel(element, type, shape, translucency)) {
        translucency.model = ReadAnalytic(element, type);
      }
    } catch (const Error& e) {
      // What the reader found has its line already; what the model found, not yet.
      if (e.code() == ExitCode::kUsage) {
        element.Fail(e.what());
      }
      throw;
    }
  } else {
    // Even a lenient reader can't guess a material.
    std::vector<std::string> known = analytic;
    known.emplace_back("svd");
    element.Fail(fmt::format("no subsurface '{}'{}", type, Suggestion(type, known)));
  }
  element.Finish();
  if (translucency.model != nullptr) {
    shape.translucency = std::move(translucency);
  }
}

}  // namespace nacre::render
