#include "cli/preset/preset.h"
#include "cli/view/view.h"
#include "core/json.h"

namespace nacre::cli::view {

std::map<std::string, web::Handler> PresetView(const std::filesystem::path& folder,
                                               const std::filesystem::path& against) {
  const preset::Preset preset = preset::ReadPreset(folder);
  std::map<std::string, web::Handler> routes =
      SampleView(preset.File("material"), against, {});
  Json state = ParseJson(routes.at("state.json")({}).body, "state");
  state["kind"] = "preset";
  state["title"] = preset.title;
  state["preset"] = preset::ToJson(preset);
  routes["state.json"] = [text = state.dump()](const web::Query&) {
    return web::Answer{text};
  };
  return routes;
}

}  // namespace nacre::cli::view
