#include "rigs/internal/gige_frame.h"

#include <algorithm>

namespace nacre::rigs::internal {
namespace {

// Of IP, UDP and GVSP headers in a stream packet.
constexpr std::uint32_t kPacketOverhead = 36;

enum PacketType : std::uint32_t { kLeader = 1, kTrailer = 2, kPayloadData = 3 };

std::uint32_t MaxCount(std::uint32_t pixel_format) {
  switch (pixel_format) {
    case 0x01100007:  // Mono16
    case 0x01100031:  // BayerBG16
      return 0xFFFF;
    default: {
      const std::uint32_t bits = BitsPerPixel(pixel_format);
      return bits == 12 || bits == 16 ? 0xFFF : 0xFF;
    }
  }
}

Bytes Packet(std::uint16_t frame_id, PacketType type, std::uint32_t number) {
  Bytes packet;
  Put(packet, 0, 2);
  Put(packet, frame_id, 2);
  Put(packet, type << 24 | number, 4);
  return packet;
}

}  // namespace

std::uint32_t BitsPerPixel(std::uint32_t pixel_format) {
  return pixel_format >> 16 & 0xFF;
}

Bytes PackCounts(const FrameHeader& frame,
                 const std::function<std::uint32_t(int x, int y)>& count) {
  const std::uint32_t bits = BitsPerPixel(frame.pixel_format);
  const std::uint32_t max = MaxCount(frame.pixel_format);
  const int samples = bits == 24 ? 3 : 1;
  const int left = static_cast<int>(frame.left) * samples;
  const int width = static_cast<int>(frame.width) * samples;
  Bytes image;
  std::uint32_t even = 0;  // of a pair of 12-bit counts
  for (int y = 0; y < static_cast<int>(frame.height); ++y) {
    for (int x = 0; x < width; ++x) {
      const std::uint32_t value =
          std::min(max, count(left + x, static_cast<int>(frame.top) + y));
      if (bits == 12 && x % 2 == 0) {
        even = value;
      } else if (bits == 12) {
        image.push_back(static_cast<std::uint8_t>(even));
        image.push_back(static_cast<std::uint8_t>(even >> 8 | (value & 0xF) << 4));
        image.push_back(static_cast<std::uint8_t>(value >> 4));
      } else {
        image.push_back(static_cast<std::uint8_t>(value));
        if (bits == 16) {
          image.push_back(static_cast<std::uint8_t>(value >> 8));
        }
      }
    }
  }
  return image;
}

std::vector<Bytes> FramePackets(const FrameHeader& frame,
                                const Bytes& image,
                                std::uint64_t time_ns,
                                std::uint32_t packet_bytes) {
  std::vector<Bytes> packets{Packet(frame.frame_id, kLeader, 0)};
  Bytes& leader = packets[0];
  Put(leader, 1, 4);  // an image
  Put(leader, static_cast<std::uint32_t>(time_ns >> 32), 4);
  Put(leader, static_cast<std::uint32_t>(time_ns), 4);
  for (const std::uint32_t value :
       {frame.pixel_format, frame.width, frame.height, frame.left, frame.top}) {
    Put(leader, value, 4);
  }
  Put(leader, 0, 4);  // no padding
  const std::size_t room = packet_bytes - kPacketOverhead;
  std::uint32_t number = 1;
  for (std::size_t begin = 0; begin < image.size(); begin += room, ++number) {
    Bytes& packet = packets.emplace_back(Packet(frame.frame_id, kPayloadData, number));
    Append(packet,
           image.data() + begin,
           image.data() + std::min(begin + room, image.size()));
  }
  Bytes& trailer = packets.emplace_back(Packet(frame.frame_id, kTrailer, number));
  Put(trailer, 1, 4);
  Put(trailer, frame.height, 4);
  return packets;
}

}  // namespace nacre::rigs::internal
