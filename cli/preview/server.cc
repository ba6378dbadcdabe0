#include "cli/preview/server.h"

#include "cli/preview/page.h"
#include "core/error.h"

#include <chrono>
#include <fmt/format.h>
#include <httplib.h>
#include <sys/random.h>
#include <thread>

namespace nacre::cli::preview {
namespace {

constexpr const char* kAddress = "127.0.0.1";
constexpr int kMaxSidePx = 720;
constexpr std::size_t kThreads = 2;

std::string RandomToken() {
  unsigned char bytes[16];
  if (::getrandom(bytes, sizeof bytes, 0) != sizeof bytes) {
    throw SystemError("cannot get a random token for the preview");
  }
  std::string token;
  for (const unsigned char byte : bytes) {
    token += fmt::format("{:02x}", byte);
  }
  return token;
}

}  // namespace

struct Server::Parts {
  httplib::Server http;
  std::string url;
  std::thread thread;
};

Server::Server(const Monitor& monitor, int port) : parts_(std::make_unique<Parts>()) {
  httplib::Server& http = parts_->http;
  http.new_task_queue = [] { return new httplib::ThreadPool(kThreads); };
  // httplib would share the port with others (SO_REUSEPORT).
  http.set_socket_options([](socket_t) {});
  http.set_default_headers(
      {{"Cache-Control", "no-store"},
       {"Referrer-Policy", "no-referrer"},
       {"X-Content-Type-Options", "nosniff"},
       {"Content-Security-Policy",
        "default-src 'none'; img-src 'self' data:; connect-src 'self'; style-src "
        "'unsafe-inline'; script-src 'unsafe-inline'; frame-ancestors 'none'"}});
  const int bound = port == 0 ? http.bind_to_any_port(kAddress)
                              : (http.bind_to_port(kAddress, port) ? port : -1);
  if (bound < 0) {
    throw Error(
        fmt::format("preview: cannot listen on {}:{}; choose another --preview-port",
                    kAddress,
                    port));
  }
  // Who can make a browser ask us by another name than our own is no friend.
  const std::string host = fmt::format("{}:{}", kAddress, bound);
  http.set_pre_routing_handler(
      [host](const httplib::Request& request, httplib::Response& response) {
        if (request.get_header_value("Host") == host) {
          return httplib::Server::HandlerResponse::Unhandled;
        }
        response.status = 403;
        return httplib::Server::HandlerResponse::Handled;
      });
  const std::string folder = '/' + RandomToken() + '/';
  http.Get(folder, [](const httplib::Request&, httplib::Response& response) {
    response.set_content(kPage, "text/html; charset=utf-8");
  });
  http.Get(folder + "state\\.json",
           [&monitor](const httplib::Request&, httplib::Response& response) {
             response.set_content(monitor.StateJson(), "application/json");
           });
  http.Get(folder + "frame\\.png",
           [&monitor](const httplib::Request&, httplib::Response& response) {
             const std::string png = monitor.FramePng(kMaxSidePx);
             response.status = png.empty() ? 404 : 200;
             response.set_content(png, "image/png");
           });
  parts_->url = "http://" + host + folder;
  parts_->thread = std::thread([&http] { http.listen_after_bind(); });
  while (!http.is_running()) {  // stop() wouldn't stop what hasn't begun
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

Server::~Server() {
  parts_->http.stop();
  parts_->thread.join();
}

const std::string& Server::url() const {
  return parts_->url;
}

}  // namespace nacre::cli::preview
