#include "cli/web/local_server.h"

#include "core/error.h"

#include <charconv>
#include <chrono>
#include <fmt/format.h>
#include <httplib.h>
#include <sys/random.h>
#include <thread>

namespace nacre::cli::web {
namespace {

constexpr const char* kAddress = "127.0.0.1";
constexpr std::size_t kThreads = 8;  // a browser asks by six connections at once

std::string RandomToken() {
  unsigned char bytes[16];
  if (::getrandom(bytes, sizeof bytes, 0) != sizeof bytes) {
    throw SystemError("cannot get a random token for a local page");
  }
  std::string token;
  for (const unsigned char byte : bytes) {
    token += fmt::format("{:02x}", byte);
  }
  return token;
}

void Respond(const Handler& handler,
             const httplib::Request& request,
             httplib::Response& response) {
  Answer answer;
  try {
    answer = handler({request.params.begin(), request.params.end()});
  } catch (const Error& error) {
    answer = {error.what(), "text/plain; charset=utf-8", 400};
  } catch (const std::exception& error) {
    answer = {error.what(), "text/plain; charset=utf-8", 500};
  }
  response.status = answer.status;
  response.set_content(answer.body, answer.type);
}

template <class Value>
Value Parse(const Query& query,
            const std::string& name,
            Value low,
            Value high,
            Value otherwise) {
  const auto found = query.find(name);
  if (found == query.end()) {
    return otherwise;
  }
  const std::string& text = found->second;
  Value value{};
  const auto [end, error] =
      std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() ||
      !(value >= low && value <= high)) {
    throw UsageError(
        fmt::format("{} = '{}': it must be from {} to {}", name, text, low, high));
  }
  return value;
}

}  // namespace

struct LocalServer::Parts {
  httplib::Server http;
  std::string url;
  std::thread thread;
};

LocalServer::LocalServer(int port,
                         std::map<std::string, Handler> handlers,
                         const std::string& remedy)
    : parts_(std::make_unique<Parts>()) {
  httplib::Server& http = parts_->http;
  http.new_task_queue = [] { return new httplib::ThreadPool(kThreads); };
  // A connection that is kept open holds a thread, and is closed under the browser's
  // next question when its time is over.
  http.set_keep_alive_max_count(1);
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
    throw Error(fmt::format("cannot listen on {}:{}; {}", kAddress, port, remedy));
  }
  // Who can make a browser ask us by another name than our own is no friend, nor is a
  // page of another origin.
  const std::string host = fmt::format("{}:{}", kAddress, bound);
  http.set_pre_routing_handler(
      [host](const httplib::Request& request, httplib::Response& response) {
        const std::string origin = request.get_header_value("Origin");
        if (request.get_header_value("Host") == host &&
            (origin.empty() || origin == "http://" + host)) {
          return httplib::Server::HandlerResponse::Unhandled;
        }
        response.status = 403;
        return httplib::Server::HandlerResponse::Handled;
      });
  const std::string folder = '/' + RandomToken() + '/';
  // One route and a lookup: names aren't patterns, and nothing here is a path.
  http.Get(folder + "(.*)",
           [handlers = std::move(handlers)](const httplib::Request& request,
                                            httplib::Response& response) {
             const auto found = handlers.find(request.matches[1].str());
             if (found == handlers.end()) {
               response.status = 404;
               return;
             }
             Respond(found->second, request, response);
           });
  parts_->url = "http://" + host + folder;
  parts_->thread = std::thread([&http] { http.listen_after_bind(); });
  while (!http.is_running()) {  // stop() wouldn't stop what hasn't begun
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

LocalServer::~LocalServer() {
  parts_->http.stop();
  parts_->thread.join();
}

const std::string& LocalServer::url() const {
  return parts_->url;
}

int Number(
    const Query& query, const std::string& name, int low, int high, int otherwise) {
  return Parse(query, name, low, high, otherwise);
}

double Real(const Query& query,
            const std::string& name,
            double low,
            double high,
            double otherwise) {
  return Parse(query, name, low, high, otherwise);
}

}  // namespace nacre::cli::web
