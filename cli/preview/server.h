#pragma once

#include "cli/preview/monitor.h"
#include "cli/web/local_server.h"

#include <string>

namespace nacre::cli::preview {

/// Serves one page that shows what a Monitor knows, on this machine only. Only reads.
class Server {
 public:
  /// `port` 0: any free one. Throws Error if it is taken. `monitor` must outlive this.
  Server(const Monitor& monitor, int port);

  /// http://127.0.0.1:PORT/TOKEN/
  const std::string& url() const;

 private:
  web::LocalServer server_;
};

}  // namespace nacre::cli::preview
