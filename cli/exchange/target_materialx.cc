#include "cli/exchange/targets.h"
#include "core/atomic_file.h"

#include <fmt/format.h>

namespace nacre::exchange {

Files WriteMaterialX(const ProfileFit& fit, const std::filesystem::path& folder) {
  Files files;
  const std::vector<float> lengths = MeanFreePaths(fit.maps);
  const auto longest_mm = static_cast<double>(Largest(lengths));
  WriteMap(fit.maps, fit.maps.albedo, 1, folder / "subsurface_color.exr", files);
  WriteMap(
      fit.maps, lengths, 1 / longest_mm, folder / "subsurface_radius_scale.exr", files);
  const char* image =
      R"(    <image name="{}" type="color3">
      <input name="file" type="filename" value="{}" colorspace="lin_rec709"/>
    </image>
)";
  std::string images =
      fmt::format(fmt::runtime(image), "color", "subsurface_color.exr");
  images +=
      fmt::format(fmt::runtime(image), "radius_scale", "subsurface_radius_scale.exr");
  WriteFile(folder / "material.mtlx",
            fmt::format(R"(<?xml version="1.0"?>
<!-- subsurface_radius is {:.6g} mm, written in metres as one scene unit is taken for a metre (MaterialX leaves
     the unit to the program): multiply it where a unit is something else. The sample is {:.6g} x {:.6g} mm. -->
<materialx version="1.38" distanceunit="meter">
  <nodegraph name="NG_nacre">
{}    <output name="color_out" type="color3" nodename="color"/>
    <output name="radius_scale_out" type="color3" nodename="radius_scale"/>
  </nodegraph>
  <open_pbr_surface name="nacre_openpbr" type="surfaceshader">
    <input name="base_color" type="color3" nodegraph="NG_nacre" output="color_out"/>
    <input name="specular_ior" type="float" value="{:.6g}"/>
    <input name="subsurface_weight" type="float" value="1"/>
    <input name="subsurface_color" type="color3" nodegraph="NG_nacre" output="color_out"/>
    <input name="subsurface_radius" type="float" value="{:.6g}"/>
    <input name="subsurface_radius_scale" type="color3" nodegraph="NG_nacre" output="radius_scale_out"/>
  </open_pbr_surface>
  <surfacematerial name="nacre" type="material">
    <input name="surfaceshader" type="surfaceshader" nodename="nacre_openpbr"/>
  </surfacematerial>
  <standard_surface name="nacre_standard" type="surfaceshader">
    <input name="base" type="float" value="1"/>
    <input name="base_color" type="color3" nodegraph="NG_nacre" output="color_out"/>
    <input name="specular_IOR" type="float" value="{:.6g}"/>
    <input name="subsurface" type="float" value="1"/>
    <input name="subsurface_color" type="color3" nodegraph="NG_nacre" output="color_out"/>
    <input name="subsurface_radius" type="color3" nodegraph="NG_nacre" output="radius_scale_out"/>
    <input name="subsurface_scale" type="float" value="{:.6g}"/>
  </standard_surface>
  <surfacematerial name="nacre_as_standard_surface" type="material">
    <input name="surfaceshader" type="surfaceshader" nodename="nacre_standard"/>
  </surfacematerial>
</materialx>
)",
                        longest_mm,
                        fit.maps.WidthMm(),
                        fit.maps.HeightMm(),
                        images,
                        fit.maps.eta,
                        longest_mm / 1000,
                        fit.maps.eta,
                        longest_mm / 1000));
  files.emplace_back("material.mtlx");
  return files;
}

}  // namespace nacre::exchange
