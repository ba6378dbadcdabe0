#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>

namespace nacre::cli::web {

struct Answer {
  std::string body;
  std::string type = "application/json";
  int status = 200;
};

/// The parameters of a request, decoded.
using Query = std::map<std::string, std::string>;

/// Answers one name of a page. Called from several threads. What it throws becomes the
/// answer: 400 with the message for our own errors, else 500.
using Handler = std::function<Answer(const Query&)>;

/// Serves a page to this machine only: listens on 127.0.0.1, answers nothing that
/// doesn't name its random token, nothing that a web page of somebody else could ask
/// for by another host name or from another origin, and only GET.
class LocalServer {
 public:
  /// `handlers` by name beneath the page's address, "" being the page itself. `port` 0:
  /// any free one. Throws Error if it is taken; `remedy` then says what to do.
  LocalServer(int port,
              std::map<std::string, Handler> handlers,
              const std::string& remedy);
  ~LocalServer();
  LocalServer(const LocalServer&) = delete;
  LocalServer& operator=(const LocalServer&) = delete;

  /// http://127.0.0.1:PORT/TOKEN/
  const std::string& url() const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// A whole number from `low` to `high` that a query gives as `name`; without it,
/// `otherwise`. Throws UsageError for anything else.
int Number(
    const Query& query, const std::string& name, int low, int high, int otherwise);
double Real(const Query& query,
            const std::string& name,
            double low,
            double high,
            double otherwise);

}  // namespace nacre::cli::web
