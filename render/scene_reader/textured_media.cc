// Analytic models of translucency whose parameters are textures.

#include "render/scene_reader/textured_media.h"

#include "core/fresnel.h"
#include "render/scene_reader/objects.h"
#include "render/subsurface/analytic_profiles.h"
#include "render/subsurface/dipole_profile.h"
#include "render/subsurface/textured_model.h"

#include <algorithm>

namespace nacre::render {
namespace {

/// Light that spreads over less than this part of a patch can't be told from light that
/// leaves where it entered.
constexpr double kLeastOfPatch = 0.25;

bool IsTexture(const Element& element, const char* name) {
  for (const pugi::xml_node& child : element.node().children()) {
    const std::string tag = child.name();
    if ((tag == "texture" || tag == "ref") &&
        std::string(child.attribute("name").value()) == name) {
      return true;
    }
  }
  return false;
}

double ReadEta(Element& element, double otherwise, const char* inside) {
  const double in =
      element.Has("intIOR") ? element.RefractiveIndex("intIOR", inside) : otherwise;
  return in / element.RefractiveIndex("extIOR", "vacuum");
}

// Albedo where light spreads too little for patches to show it.
class LocalAlbedo final : public Texture {
 public:
  LocalAlbedo(TexturePtr albedo, TexturePtr length_mm, float least_mm)
      : albedo_(std::move(albedo)),
        length_mm_(std::move(length_mm)),
        least_mm_(least_mm) {}
  Color At(Vec2 uv) const override {
    const Color albedo = albedo_->At(uv);
    const Color length = length_mm_->At(uv);
    return {length.x < least_mm_ ? albedo.x : 0,
            length.y < least_mm_ ? albedo.y : 0,
            length.z < least_mm_ ? albedo.z : 0};
  }
  Color Mean() const override { return albedo_->Mean(); }
  Color Max() const override { return albedo_->Max(); }

 private:
  TexturePtr albedo_;
  TexturePtr length_mm_;
  float least_mm_;
};

bool ReadTexturedDiffusion(Element& element, Shape& shape, Translucency& translucency) {
  const TexturePtr albedo = element.Reflectance("reflectance", {0.5F, 0.5F, 0.5F});
  const TexturePtr length = element.TextureOr("meanFreePath", {1, 1, 1});
  const Color mean = length->Mean();
  if (albedo->IsConstant() && length->IsConstant() &&
      std::min({mean.x, mean.y, mean.z}) > 0) {
    return false;
  }
  TexturedMedium medium{albedo, length, {}, 1};
  medium.eta = static_cast<float>(ReadEta(element, 1.5, "water"));
  const auto spreading = [](double least_mm) {
    return [least_mm](double a, double l) -> std::shared_ptr<const RadialProfile> {
      return l > 0 && l >= least_mm ? MakeNormalizedDiffusion(std::min(a, 1.0), l)
                                    : nullptr;
    };
  };
  medium.profile = spreading(0);
  double least_mm = 0;
  if (MaxComponent(length->Max()) > 0) {
    least_mm = kLeastOfPatch * static_cast<double>(TexturedPatchMm(medium));
    medium.profile = spreading(least_mm);
    const TexturedTranslucency made = MakeTextured(medium);
    translucency.model = made.model;
    translucency.exit_scale = made.total;
  }
  const auto least =
      std::max(static_cast<float>(least_mm), std::numeric_limits<float>::min());
  shape.bsdf = MakeLocalTranslucency(
      shape.bsdf, std::make_shared<LocalAlbedo>(albedo, length, least), medium.eta);
  return true;
}

ProfileOf ProfileOfType(Element& element, const std::string& type, double eta) {
  if (type == "dipole") {
    return [inside = DiffuseFresnelReflectance(1 / eta)](
               double a, double s) -> std::shared_ptr<const RadialProfile> {
      return s > 0 ? std::make_shared<DipoleProfile>(a, s, inside) : nullptr;
    };
  }
  if (type == "multipole") {
    const double thickness_mm =
        InRange(element, "thickness", element.Float("thickness", 1), {1e-6, 1e9});
    return [eta, thickness_mm](double a, double s) {
      return s > 0 ? MakeMultipole({a, s, eta}, thickness_mm) : nullptr;
    };
  }
  return [eta](double a, double s) {
    return s > 0 ? MakeBetterDipole({a, s, eta}) : nullptr;
  };
}

}  // namespace

std::optional<TexturedCoefficients> ReadTexturedCoefficients(Element& element) {
  const bool pair = IsTexture(element, "sigmaS") || IsTexture(element, "sigmaA");
  const bool total = IsTexture(element, "sigmaT") || IsTexture(element, "albedo");
  if (!pair && !total) {
    return std::nullopt;
  }
  const bool both = pair ? element.Has("sigmaT") || element.Has("albedo")
                         : element.Has("sigmaS") || element.Has("sigmaA");
  if (both || element.Has("material")) {
    element.Fail(
        "give one of: 'material'; 'sigmaS' and 'sigmaA'; 'sigmaT' and 'albedo'");
  }
  if (pair) {
    return TexturedCoefficients{element.TextureOr("sigmaS", {0, 0, 0}),
                                element.TextureOr("sigmaA", {0, 0, 0})};
  }
  const TexturePtr sigma_t = element.TextureOr("sigmaT", {0, 0, 0});
  const TexturePtr albedo = element.Reflectance("albedo", {0, 0, 0});
  return TexturedCoefficients{MakeProduct(sigma_t, albedo),
                              MakeProduct(sigma_t, MakeComplement(albedo))};
}

bool ReadTexturedModel(Element& element,
                       const std::string& type,
                       Shape& shape,
                       Translucency& translucency) {
  if (type == "normalizeddiffusion") {
    return ReadTexturedDiffusion(element, shape, translucency);
  }
  const auto coefficients = ReadTexturedCoefficients(element);
  if (!coefficients) {
    return false;
  }
  const auto g =
      static_cast<float>(InRange(element, "g", element.Float("g", 0), {-0.999, 0.999}));
  const double eta = ReadEta(element, 1.5, "water");
  const TexturePtr reduced =
      MakeProduct(coefficients->sigma_s, MakeConstant(Color{1, 1, 1} * (1 - g)));
  const TexturedTranslucency made = MakeTextured({coefficients->sigma_a,
                                                  reduced,
                                                  ProfileOfType(element, type, eta),
                                                  static_cast<float>(eta)});
  translucency.model = made.model;
  translucency.exit_scale = made.total;
  return true;
}

}  // namespace nacre::render
