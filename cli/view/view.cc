#include "cli/view/view.h"

#include "cli/artefact.h"
#include "cli/view/page.h"
#include "core/error.h"
#ifdef NACRE_HAS_PRESETS
#include "cli/preset/preset.h"
#endif

namespace nacre::cli::view {
namespace {

std::map<std::string, web::Handler> RoutesOf(const std::filesystem::path& path,
                                             const std::filesystem::path& against,
                                             const ProgressFunction& progress) {
#ifdef NACRE_HAS_PRESETS
  const std::filesystem::path material = preset::MaterialPath(path);
  if (std::filesystem::exists(material.parent_path() / "preset.toml")) {
    return PresetView(material.parent_path(), against);
  }
#endif
#ifdef NACRE_HAS_ACQUIRE
  if (DetectKind(path) == ArtefactKind::kSession) {
    if (!against.empty()) {
      throw UsageError("--against: a session has no slices to compare");
    }
    return SessionView(path);
  }
#endif
  return SampleView(path, against, progress);
}

}  // namespace

std::map<std::string, web::Handler> OpenView(const std::filesystem::path& path,
                                             const std::filesystem::path& against,
                                             const ProgressFunction& progress) {
  std::map<std::string, web::Handler> routes = RoutesOf(path, against, progress);
  routes[""] = [](const web::Query&) {
    return web::Answer{kPage, "text/html; charset=utf-8"};
  };
  return routes;
}

}  // namespace nacre::cli::view
