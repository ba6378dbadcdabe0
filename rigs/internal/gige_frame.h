#pragma once

#include "rigs/internal/udp_socket.h"

#include <functional>

namespace nacre::rigs::internal {

/// What a GVSP leader says of a frame.
struct FrameHeader {
  std::uint32_t pixel_format = 0;  ///< GenICam's PFNC code
  std::uint32_t width = 0;         ///< of the region, px
  std::uint32_t height = 0;
  std::uint32_t left = 0;
  std::uint32_t top = 0;
  std::uint16_t frame_id = 0;
};

std::uint32_t BitsPerPixel(std::uint32_t pixel_format);

/// The region's counts as the pixel format lays them out, cut to its depth. `count` is
/// asked for columns of the sensor, of RGB8 for three a pixel.
Bytes PackCounts(const FrameHeader& frame,
                 const std::function<std::uint32_t(int x, int y)>& count);

/// Leader, packets of `packet_bytes` with the image, trailer.
std::vector<Bytes> FramePackets(const FrameHeader& frame,
                                const Bytes& image,
                                std::uint64_t time_ns,
                                std::uint32_t packet_bytes);

}  // namespace nacre::rigs::internal
