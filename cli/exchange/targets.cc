// What the targets share, and the ones that take a few lines.

#include "cli/exchange/targets.h"

#include "cli/exchange/burley.h"
#include "core/atomic_file.h"

#include <algorithm>
#include <fmt/format.h>

namespace nacre::exchange {

namespace fs = std::filesystem;

std::vector<float> MeanFreePaths(const ProfileMaps& maps) {
  std::vector<float> lengths(maps.d_mm.size());
  for (std::size_t n = 0; n < lengths.size(); ++n) {
    lengths[n] = static_cast<float>(static_cast<double>(maps.d_mm[n]) *
                                    BurleyScaling(static_cast<double>(maps.albedo[n])));
  }
  return lengths;
}

float Largest(const std::vector<float>& values) {
  return *std::max_element(values.begin(), values.end());
}

std::array<double, 3> MeanColor(const ProfileMaps& maps,
                                const std::vector<float>& values) {
  std::array<double, 3> color{};
  const std::size_t pixels = maps.PixelCount();
  for (std::size_t c = 0; c < 3; ++c) {
    const std::size_t from = maps.channels.size() == 3 ? c : 0;
    for (std::size_t p = 0; p < pixels; ++p) {
      color[c] += static_cast<double>(values[from * pixels + p]);
    }
    color[c] /= static_cast<double>(pixels);
  }
  return color;
}

std::string Triple(const std::array<double, 3>& color, const char* separator) {
  return fmt::format(
      "{:.6g}{}{:.6g}{}{:.6g}", color[0], separator, color[1], separator, color[2]);
}

void WriteMap(const ProfileMaps& maps,
              const std::vector<float>& values,
              double scale,
              const fs::path& path,
              Files& files) {
  WriteExr(path, {MapPicture(maps, values, scale)});
  files.push_back(path.filename().string());
}

Files WritePbrt(const ProfileFit& fit, const fs::path& folder) {
  Files files;
  WriteMap(fit.maps, fit.maps.albedo, 1, folder / "reflectance.exr", files);
  WriteMap(fit.maps, MeanFreePaths(fit.maps), 1, folder / "mfp.exr", files);
  WriteFile(
      folder / "material.pbrt",
      fmt::format(
          R"(# To include in a scene of pbrt-v4 whose unit is the millimetre; else change "scale".
# The sample is {:.6g} x {:.6g} mm: scale texture coordinates so that u = v = 1 are that far.
Texture "nacre-reflectance" "spectrum" "imagemap"
    "string filename" "reflectance.exr" "string encoding" "linear"
Texture "nacre-mfp" "spectrum" "imagemap"
    "string filename" "mfp.exr" "string encoding" "linear"
MakeNamedMaterial "nacre" "string type" "subsurface"
    "texture reflectance" "nacre-reflectance"
    "texture mfp" "nacre-mfp"
    "float scale" 1
    "float eta" {:.6g}
)",
          fit.maps.WidthMm(),
          fit.maps.HeightMm(),
          fit.maps.eta));
  files.emplace_back("material.pbrt");
  return files;
}

Files WriteRenderMan(const ProfileFit& fit, const fs::path& folder) {
  Files files;
  const std::vector<float> lengths = MeanFreePaths(fit.maps);
  const float longest = Largest(lengths);
  WriteMap(fit.maps, fit.maps.albedo, 1, folder / "subsurfaceColor.exr", files);
  WriteMap(fit.maps,
           lengths,
           1 / static_cast<double>(longest),
           folder / "subsurfaceDmfpColor.exr",
           files);
  WriteFile(
      folder / "material.rib",
      fmt::format(
          R"(# PxrSurface, model 4 (Burley). Mean free paths in millimetres: multiply subsurfaceDmfp by
# scene units a millimetre. The sample is {:.6g} x {:.6g} mm.
Pattern "PxrTexture" "nacre_color" "string filename" ["subsurfaceColor.exr"] "int linearize" [0]
Pattern "PxrTexture" "nacre_mfp" "string filename" ["subsurfaceDmfpColor.exr"] "int linearize" [0]
Bxdf "PxrSurface" "nacre"
    "float diffuseGain" [0]
    "int subsurfaceType" [4]
    "float subsurfaceGain" [1]
    "reference color subsurfaceColor" ["nacre_color:resultRGB"]
    "float subsurfaceDmfp" [{:.6g}]
    "reference color subsurfaceDmfpColor" ["nacre_mfp:resultRGB"]
)",
          fit.maps.WidthMm(),
          fit.maps.HeightMm(),
          longest));
  files.emplace_back("material.rib");
  return files;
}

Files WriteAppleseed(const ProfileFit& fit, const fs::path& folder) {
  Files files;
  const std::vector<float> lengths = MeanFreePaths(fit.maps);
  WriteMap(fit.maps, fit.maps.albedo, 1, folder / "reflectance.exr", files);
  WriteMap(fit.maps, lengths, 1, folder / "mfp.exr", files);
  WriteFile(
      folder / "material.appleseed",
      fmt::format(
          R"(<!-- Parts of an assembly whose unit is the millimetre; else set mfp_multiplier to scene units a
     millimetre. The sample is {:.6g} x {:.6g} mm. -->
<texture name="nacre_reflectance" model="disk_texture_2d">
    <parameter name="filename" value="reflectance.exr"/>
    <parameter name="color_space" value="linear_rgb"/>
</texture>
<texture_instance name="nacre_reflectance_inst" texture="nacre_reflectance"/>
<texture name="nacre_mfp" model="disk_texture_2d">
    <parameter name="filename" value="mfp.exr"/>
    <parameter name="color_space" value="linear_rgb"/>
</texture>
<texture_instance name="nacre_mfp_inst" texture="nacre_mfp"/>
<bssrdf name="nacre" model="normalized_diffusion_bssrdf">
    <parameter name="weight" value="1.0"/>
    <parameter name="reflectance" value="nacre_reflectance_inst"/>
    <parameter name="mfp" value="nacre_mfp_inst"/>
    <parameter name="mfp_multiplier" value="1.0"/>
    <parameter name="ior" value="{:.6g}"/>
</bssrdf>
)",
          fit.maps.WidthMm(),
          fit.maps.HeightMm(),
          fit.maps.eta));
  files.emplace_back("material.appleseed");
  return files;
}

Files WriteMitsuba(const ProfileFit& fit, const fs::path& folder) {
  const std::array<double, 3> albedo = MeanColor(fit.maps, fit.maps.albedo);
  const std::array<double, 3> length = MeanColor(fit.maps, MeanFreePaths(fit.maps));
  std::array<double, 3> single{};
  std::array<double, 3> sigma_t{};
  for (std::size_t c = 0; c < 3; ++c) {
    single[c] = SingleScatteringAlbedo(albedo[c]);
    sigma_t[c] = 1 / length[c];
  }
  WriteFile(
      folder / "medium.xml",
      fmt::format(
          R"(<!-- Inside of a shape of Mitsuba 3 in millimetres (else set "scale" to millimetres a unit);
     the mean over the sample: diffuse albedo {}, eta {:.6g}. -->
<scene version="3.0.0">
    <medium type="homogeneous" id="nacre">
        <rgb name="sigma_t" value="{}"/>
        <rgb name="albedo" value="{}"/>
        <float name="scale" value="1"/>
        <phase type="isotropic"/>
    </medium>
</scene>
)",
          Triple(albedo, ", "),
          fit.maps.eta,
          Triple(sigma_t, ", "),
          Triple(single, ", ")));
  return {"medium.xml"};
}

}  // namespace nacre::exchange
