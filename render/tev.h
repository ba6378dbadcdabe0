#pragma once

#include "core/exr.h"

#include <string>

namespace nacre::render {

/// A picture shown while it is made, in tev (https://github.com/Tom94/tev) or what
/// speaks its protocol: packets over TCP, little-endian, each with its length first.
class TevDisplay {
 public:
  /// `address`: HOST, HOST:PORT or :PORT; localhost and 14158 if left out. Throws
  /// DeviceError if nobody listens there, a usage Error for a port that is none.
  explicit TevDisplay(const std::string& address);
  ~TevDisplay();
  TevDisplay(const TevDisplay&) = delete;
  TevDisplay& operator=(const TevDisplay&) = delete;

  /// Shows the picture under that name, in place of what it showed before. False once
  /// the viewer has gone: a picture goes on without being watched.
  bool Show(const std::string& name, const ExrPart& image);

 private:
  bool Send(const std::string& packet);

  int socket_ = -1;
  std::string created_;  ///< the name of the picture that was made
};

/// The packets themselves.
std::string TevCreatePacket(const std::string& name, const ExrPart& image);
/// Rows [first, first + count) of all channels.
std::string TevUpdatePacket(const std::string& name,
                            const ExrPart& image,
                            int first,
                            int count);

}  // namespace nacre::render
