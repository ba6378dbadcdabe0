#include "acquire/session.h"
#include "cli/preview/frame_png.h"
#include "cli/view/view.h"
#include "core/json.h"

namespace nacre::cli::view {
namespace {

constexpr int kMaxSidePx = 900;

Json StateOf(const acquire::SessionReader& session) {
  const acquire::SessionManifest& manifest = session.manifest();
  Json pictures = Json::array();
  for (std::int64_t n = 0; n < session.picture_count(); ++n) {
    const acquire::ScheduledPicture& scheduled = session.schedule()[n];
    pictures.push_back({{"number", n},
                        {"target", acquire::Name(scheduled.target)},
                        {"channel", scheduled.channel},
                        {"group", scheduled.group},
                        {"taken", session.WasTaken(n)}});
  }
  return {{"kind", "session"},
          {"title", session.rig().sample.name},
          {"camera", manifest.camera.model + ' ' + manifest.camera.serial},
          {"size_px", {manifest.camera.width, manifest.camera.height}},
          {"channels", session.rig().scanner.channels},
          {"total", session.schedule().size()},
          {"pictures", pictures}};
}

}  // namespace

std::map<std::string, web::Handler> SessionView(const std::filesystem::path& folder) {
  const auto session = std::make_shared<const acquire::SessionReader>(folder);
  const auto last = static_cast<int>(session->picture_count()) - 1;
  return {
      {"state.json",
       [session](const web::Query&) { return web::Answer{StateOf(*session).dump()}; }},
      {"frame.png", [session, last](const web::Query& query) {
         const acquire::Frame frame =
             session->ReadFrame(web::Number(query, "n", 0, std::max(0, last), 0));
         return web::Answer{
             preview::FramePng(frame, session->manifest().camera, kMaxSidePx),
             "image/png"};
       }}};
}

}  // namespace nacre::cli::view
