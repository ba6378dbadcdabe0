#include "render/named_media.h"
#include "render/scene_reader/objects.h"
#include "render/volume_file.h"

namespace nacre::render {
namespace {

float ReadPhase(Element& element, float otherwise) {
  const std::vector<Element> found = element.Objects("phase");
  if (found.size() > 1) {
    element.Fail("a medium has one phase function");
  }
  if (found.empty()) {
    return otherwise;
  }
  Element phase = found.front();
  const std::string type = phase.type();
  float g = 0;
  if (type == "hg") {
    g = static_cast<float>(InRange(phase, "g", phase.Float("g", 0.8), {-0.999, 0.999}));
  } else if (type != "isotropic") {
    UnknownPlugin(phase, {"hg", "isotropic"});
    return 0;
  }
  phase.Finish();
  return g;
}

float ReadScale(Element& element) {
  return static_cast<float>(
      InRange(element, "scale", element.Float("scale", 1), {0, 1e12}));
}

// One value everywhere, in any box.
VolumeGrid Constant(Color value) {
  return {.channels = 3, .values = {value.x, value.y, value.z}};
}

VolumeGrid ReadVolume(Element volume, Transform& world_from_grid) {
  const std::string type = volume.type();
  VolumeGrid grid;
  if (type == "constvolume") {
    const bool is_number = volume.Has("value") && volume.node().child("float");
    const auto value = static_cast<float>(is_number ? volume.Float("value", 1) : 1);
    grid = Constant(is_number ? Color{value, value, value}
                              : volume.Spectrum("value", {1, 1, 1}));
  } else if (type == "gridvolume") {
    const std::string name = volume.String("filename", "");
    if (name.empty()) {
      volume.Fail("a gridvolume needs a <string name=\"filename\">");
    }
    grid = ReadVolumeFile(volume.document().File(volume.node(), name));
    world_from_grid = volume.ToWorld();
    if (world_from_grid.Determinant() == 0) {
      volume.FailAt("toWorld", "the transform flattens the volume");
    }
  } else {
    // Even a lenient reader can't guess what fills a volume.
    volume.Fail(fmt::format(
        "no volume '{}'{}", type, Suggestion(type, {"constvolume", "gridvolume"})));
  }
  volume.Finish();
  return grid;
}

// Of the channels that scatter.
float MeanAsymmetry(const Coefficients& c) {
  float sum = 0;
  float count = 0;
  for (int channel = 0; channel < 3; ++channel) {
    if (c.sigma_s[channel] > 0) {
      sum += c.g[channel];
      ++count;
    }
  }
  return count > 0 ? sum / count : 0;
}

MediumPtr ReadHomogeneous(Element& element) {
  const Coefficients c = ReadCoefficients(element);
  const float scale = ReadScale(element);
  // One phase function serves all channels: with its mean g, scattering that keeps each
  // channel's reduced coefficient.
  const float g = MeanAsymmetry(c);
  const bool own = element.node().child("phase");
  const Color sigma_s = own ? c.sigma_s : c.sigma_s * (Color{1, 1, 1} - c.g) / (1 - g);
  return MakeHomogeneousMedium(
      c.sigma_a * scale, sigma_s * scale, ReadPhase(element, g));
}

MediumPtr ReadHeterogeneous(Element& element) {
  GridMediumParameters p;
  const std::optional<Element> density = element.Named("density", {"volume"});
  const std::optional<Element> albedo = element.Named("albedo", {"volume"});
  if (!density || !albedo) {
    element.Fail("a heterogeneous medium needs the volumes 'density' and 'albedo'");
  }
  p.density = ReadVolume(*density, p.world_from_grid);
  if (density->type() != "gridvolume" || p.density.channels != 1) {
    density->Fail("the density must be a gridvolume of one channel");
  }
  Transform albedo_place = p.world_from_grid;
  p.albedo = ReadVolume(*albedo, albedo_place);
  for (const float a : p.albedo.values) {
    if (!(a >= 0 && a <= 1)) {
      albedo->Fail(fmt::format("an albedo of {}; it must be in [0, 1]", a));
    }
  }
  if (albedo->type() == "gridvolume" &&
      (p.albedo.low == p.density.low) + (p.albedo.high == p.density.high) != 2) {
    albedo->Fail("the albedo's box isn't the density's");
  }
  const float scale = ReadScale(element);
  p.sigma_t = {scale, scale, scale};
  p.g = ReadPhase(element, 0);
  element.Ignore("method", "free paths are found by null collisions");
  return MakeGridMedium(p);
}

}  // namespace

Coefficients ReadCoefficients(Element& element) {
  const bool coefficients = element.Has("sigmaS") || element.Has("sigmaA");
  const bool albedo = element.Has("sigmaT") || element.Has("albedo");
  const bool material = element.Has("material");
  if (coefficients + albedo + material != 1) {
    element.Fail(
        "give one of: 'material'; 'sigmaS' and 'sigmaA'; 'sigmaT' and 'albedo'");
  }
  if (material) {
    const std::string name = element.String("material", "");
    const auto medium = FindNamedMedium(name);
    if (!medium) {
      element.FailAt(
          "material",
          fmt::format("no medium '{}' in the tables of Jensen et al. 2001 and "
                      "Narasimhan et al. 2006{}",
                      name,
                      Suggestion(name, NamedMediaNames())));
    }
    return {medium->sigma_s_per_mm, medium->sigma_a_per_mm, medium->eta, medium->g};
  }
  if (coefficients) {
    return {element.Spectrum("sigmaS", {0, 0, 0}),
            element.Spectrum("sigmaA", {0, 0, 0}),
            std::nullopt,
            {}};
  }
  const Color sigma_t = element.Spectrum("sigmaT", {0, 0, 0});
  const Color a = element.Spectrum("albedo", {0, 0, 0});
  if (MaxComponent(a) > 1) {
    element.FailAt("albedo", "an albedo above 1");
  }
  return {sigma_t * a, sigma_t * (Color{1, 1, 1} - a), std::nullopt, {}};
}

MediumPtr ReadMedium(Element element) {
  const std::string type = element.type();
  MediumPtr medium;
  if (type == "homogeneous") {
    medium = ReadHomogeneous(element);
  } else if (type == "heterogeneous") {
    medium = ReadHeterogeneous(element);
  } else {
    UnknownPlugin(element, {"homogeneous", "heterogeneous"});
    return nullptr;
  }
  element.Finish();
  if (!element.id().empty()) {
    element.document().media[element.id()] = medium;
  }
  return medium;
}

MediumPtr ReadMediumOr(Element& element, const char* name) {
  const std::optional<Element> found = element.Named(name, {"medium", "ref"});
  if (!found) {
    return nullptr;
  }
  if (std::string(found->node().name()) == "ref") {
    return FindById(
        element.document(), found->node(), element.document().media, "medium");
  }
  return ReadMedium(*found);
}

}  // namespace nacre::render
