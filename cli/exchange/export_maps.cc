#include "cli/exchange/export_maps.h"

#include "cli/exchange/targets.h"
#include "core/error.h"
#include "core/json.h"
#include "core/provenance.h"

namespace nacre::exchange {
namespace {

namespace fs = std::filesystem;

constexpr const char* kShape =
    "the measured profile's shape and direction (Burley's instead), and the pairs of "
    "points: light that goes from bright to dark stone is made from one end's profile";

}  // namespace

const std::vector<Target>& Targets() {
  static const std::vector<Target> targets{
      {"cycles", "Blender's Cycles, 3.4 and later", kShape, WriteCycles},
      {"pbrt-v4", "pbrt, version 4 (subsurface material)", kShape, WritePbrt},
      {"mtlx", "MaterialX: OpenPBR and Standard Surface", kShape, WriteMaterialX},
      {"renderman", "RenderMan (PxrSurface)", kShape, WriteRenderMan},
      {"appleseed", "appleseed (normalized diffusion)", kShape, WriteAppleseed},
      {"mitsuba3",
       "Mitsuba 3 (homogeneous medium)",
       "the texture: Mitsuba 3 has no BSSRDF, and its medium is the mean over the "
       "sample; the profile's shape is that of a medium without boundary",
       WriteMitsuba},
  };
  return targets;
}

const Target* FindTarget(const std::string& name) {
  for (const Target& target : Targets()) {
    if (name == target.name) {
      return &target;
    }
  }
  return nullptr;
}

Json ExportMaps(const Target& target,
                const ProfileFit& fit,
                const fs::path& file,
                const std::string& source,
                const fs::path& folder) {
  const std::size_t count = fit.maps.channels.size();
  if (count != 1 && count != 3) {
    throw UsageError(source + ": " + std::to_string(count) +
                     " channels; other renderers take one, or red, green and blue");
  }
  fs::create_directories(folder);
  const std::vector<std::string> files = target.write(fit, folder);
  Provenance provenance{.command = "export", .options = {{"to", target.name}}};
  provenance.AddInput(file);
  Json json{{"format", "nacre-export"},
            {"target", target.program},
            {"source", source},
            {"size_mm", {fit.maps.WidthMm(), fit.maps.HeightMm()}},
            {"eta", fit.maps.eta},
            {"profile", "A (exp(-r/d) + exp(-r/3d)) / (8 pi d r)"},
            {"units", "radii in millimetres unless a file says otherwise"},
            {"fit", fit.summary.ToJson()},
            {"lost", target.lost},
            {"files", files},
            {"provenance", ParseJson(provenance.ToString(), "provenance")}};
  WriteJson(folder / "export.json", json);
  return json;
}

}  // namespace nacre::exchange
