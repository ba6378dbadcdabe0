#include "cli/preview/server.h"

#include "cli/preview/page.h"

namespace nacre::cli::preview {
namespace {

constexpr int kMaxSidePx = 720;

std::map<std::string, web::Handler> Handlers(const Monitor& monitor) {
  return {{"",
           [](const web::Query&) {
             return web::Answer{kPage, "text/html; charset=utf-8"};
           }},
          {"state.json",
           [&monitor](const web::Query&) { return web::Answer{monitor.StateJson()}; }},
          {"frame.png", [&monitor](const web::Query&) {
             std::string png = monitor.FramePng(kMaxSidePx);
             const int status = png.empty() ? 404 : 200;
             return web::Answer{std::move(png), "image/png", status};
           }}};
}

}  // namespace

Server::Server(const Monitor& monitor, int port)
    : server_(port, Handlers(monitor), "preview: choose another --preview-port") {}

const std::string& Server::url() const {
  return server_.url();
}

}  // namespace nacre::cli::preview
