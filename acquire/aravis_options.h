#pragma once

#include <optional>
#include <string>

namespace nacre::acquire {

/// A part of a sensor, in pixels from its upper left corner.
struct SensorRegion {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;
};

/// How a GigE Vision or USB3 Vision camera is to be found and set.
struct AravisOptions {
  std::string id;  ///< "vendor-serial" as `nacre doctor` lists it, or an IP address
  std::string pixel_format = "Mono12";  ///< one of PixelFormatNames()
  std::string trigger = "Software";     ///< or an input of the camera: "Line1", …
  std::optional<double> gain =
      std::nullopt;  ///< in the camera's unit; else left as it is
  std::optional<SensorRegion> region = std::nullopt;  ///< else left as it is
  int packet_size_bytes = 1400;         ///< of GigE Vision, with all headers
  int socket_buffer_bytes = 4'000'000;  ///< of GigE Vision
  double reconnect_s = 60;  ///< how long a camera that went away is waited for
};

}  // namespace nacre::acquire
