#pragma once

#include "cli/preview/monitor.h"

#include <memory>
#include <string>

namespace nacre::cli::preview {

/// Serves one page that shows what a Monitor knows, on this machine only: listens on
/// 127.0.0.1, answers nothing that doesn't name its random token, and nothing that a
/// web page of somebody else could ask for by another host name. Only reads.
class Server {
 public:
  /// `port` 0: any free one. Throws Error if it is taken. `monitor` must outlive this.
  Server(const Monitor& monitor, int port);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// http://127.0.0.1:PORT/TOKEN/
  const std::string& url() const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace nacre::cli::preview
