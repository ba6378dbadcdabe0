#include "rigs/gige_camera_twin.h"

#include "core/error.h"
#include "rigs/internal/gige_registers.h"

#include <algorithm>
#include <arpa/inet.h>
#include <array>
#include <atomic>
#include <cstring>
#include <deque>
#include <fmt/format.h>
#include <mutex>
#include <netinet/in.h>
#include <optional>
#include <poll.h>
#include <random>
#include <sys/socket.h>
#include <thread>
#include <unistd.h>

namespace nacre::rigs {
namespace {

using Bytes = std::vector<std::uint8_t>;
using Clock = std::chrono::steady_clock;
using namespace internal;

constexpr std::uint16_t kGvcpPort = 3956;
constexpr std::uint32_t kMemoryBytes = 0x20000;
constexpr std::uint32_t kDiscoveryBytes = 0xF8;
// Of IP, UDP and GVSP headers in a stream packet.
constexpr std::uint32_t kPacketOverhead = 36;

// GVCP commands; each is acknowledged by its number plus one.
enum Command : std::uint16_t {
  kDiscovery = 0x02,
  kResend = 0x40,
  kReadRegister = 0x80,
  kWriteRegister = 0x82,
  kReadMemory = 0x84,
  kWriteMemory = 0x86,
};

// GVCP status codes.
constexpr std::uint16_t kNotImplemented = 0x8001;
constexpr std::uint16_t kBadAddress = 0x8003;
constexpr std::uint16_t kAccessDenied = 0x8006;

void Put(Bytes& bytes, std::uint32_t value, int byte_count) {
  for (int k = byte_count - 1; k >= 0; --k) {
    bytes.push_back(static_cast<std::uint8_t>(value >> (8 * k)));
  }
}

void Append(Bytes& bytes, const std::uint8_t* begin, const std::uint8_t* end) {
  bytes.reserve(bytes.size() + static_cast<std::size_t>(end - begin));
  for (const std::uint8_t* byte = begin; byte != end; ++byte) {
    bytes.push_back(*byte);
  }
}

std::uint32_t Take(const std::uint8_t* bytes, int byte_count) {
  std::uint32_t value = 0;
  for (int k = 0; k < byte_count; ++k) {
    value = value << 8 | bytes[k];
  }
  return value;
}

class UdpSocket {
 public:
  UdpSocket() : fd_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
    if (fd_ < 0) {
      throw SystemError("camera twin: a UDP socket");
    }
  }
  ~UdpSocket() { close(fd_); }
  UdpSocket(const UdpSocket&) = delete;
  UdpSocket& operator=(const UdpSocket&) = delete;

  int fd() const { return fd_; }

  bool Bind(std::uint32_t address, std::uint16_t port) {
    sockaddr_in name = Name(address, port);
    return bind(fd_, reinterpret_cast<const sockaddr*>(&name), sizeof name) == 0;
  }
  void ShareAddress() {
    const int on = 1;
    setsockopt(fd_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  }
  // What the network loses is lost, as with any camera.
  void Send(const Bytes& bytes, const sockaddr_in& to) {
    (void)!sendto(fd_,
                  bytes.data(),
                  bytes.size(),
                  0,
                  reinterpret_cast<const sockaddr*>(&to),
                  sizeof to);
  }
  std::size_t Receive(std::array<std::uint8_t, 2048>& bytes, sockaddr_in& from) {
    socklen_t length = sizeof from;
    const ssize_t count = recvfrom(fd_,
                                   bytes.data(),
                                   bytes.size(),
                                   0,
                                   reinterpret_cast<sockaddr*>(&from),
                                   &length);
    return count > 0 ? static_cast<std::size_t>(count) : 0;
  }

  static sockaddr_in Name(std::uint32_t address, std::uint16_t port) {
    sockaddr_in name{};
    name.sin_family = AF_INET;
    name.sin_addr.s_addr = htonl(address);
    name.sin_port = htons(port);
    return name;
  }

 private:
  int fd_;
};

}  // namespace

struct GigeCameraTwin::Parts {
  explicit Parts(const GigeCameraTwinOptions& given)
      : options(given), xml(GigeCameraXml(given.width, given.height)) {
    Expect(kXml + xml.size() < kMemoryBytes, "room for the description");
    // Any address below 127/8 is this machine; one that is free for this camera alone.
    std::random_device seed;
    do {
      address = 127U << 24 | (seed() % 0xFFFF00U + 0x80U);
    } while (!control.Bind(address, kGvcpPort));
    if (!stream.Bind(address, 0)) {
      throw SystemError("camera twin: a stream socket");
    }
    broadcast.ShareAddress();
    broadcast.Bind(INADDR_BROADCAST, kGvcpPort);  // not found by broadcast if taken
    address_text = fmt::format(
        "127.{}.{}.{}", address >> 16 & 0xFF, address >> 8 & 0xFF, address & 0xFF);
    PowerOn();
    thread = std::thread([this] { Run(); });
  }

  ~Parts() {
    stopping = true;
    thread.join();
  }

  std::uint32_t Get(std::uint32_t at) const { return Take(&memory[at], 4); }
  void Set(std::uint32_t at, std::uint32_t value) {
    for (std::uint32_t k = 0; k < 4; ++k) {
      memory[at + k] = static_cast<std::uint8_t>(value >> (24 - 8 * k));
    }
  }
  void SetText(std::uint32_t at, const std::string& text) {
    std::copy(text.begin(), text.end(), memory.begin() + at);
  }

  void PowerOn() {
    memory.assign(kMemoryBytes, 0);
    Set(kVersion, 0x00010002);
    Set(kDeviceMode, 0x80000001);
    Set(kMacHigh, 0x0200);
    Set(kMacLow, address);
    Set(kCurrentIp, address);
    SetText(kManufacturer, "Nacre");
    SetText(kModel, "GigeTwin");
    SetText(kDeviceVersion, "1");
    SetText(kSerial, options.serial);
    SetText(kXmlUrl,
            fmt::format("Local:twin.xml;{:X};{:X}", std::uint32_t{kXml}, xml.size()));
    SetText(kXml, xml);
    Set(kInterfaceCount, 1);
    Set(kStreamCount, 1);
    Set(kHeartbeatMs, 3000);
    Set(kTickFrequencyLow, 1'000'000'000);
    Set(kPacketSize, 1400);
    Set(kWidth, static_cast<std::uint32_t>(options.width));
    Set(kHeight, static_cast<std::uint32_t>(options.height));
    Set(kPixelFormat, 0x01080001);
    Set(kExposure, 10'000);
    Set(kTemperature, 41);
    SetPayload();
    frame_id = 0;
    controller.reset();
    silent = false;
    taken_by_another = false;
  }

  int BitsPerPixel() const { return static_cast<int>(Get(kPixelFormat) >> 16 & 0xFF); }
  void SetPayload() {
    Set(kPayload,
        Get(kWidth) * Get(kHeight) * static_cast<std::uint32_t>(BitsPerPixel()) / 8);
  }

  bool IsController(const sockaddr_in& from) const {
    return controller && controller->sin_port == from.sin_port &&
           controller->sin_addr.s_addr == from.sin_addr.s_addr;
  }

  // Returns the status of a write.
  std::uint16_t Write(std::uint32_t at, std::uint32_t value, const sockaddr_in& from) {
    if (at > kMemoryBytes - 4) {
      return kBadAddress;
    }
    if (controller &&
        Clock::now() - last_heard > std::chrono::milliseconds(Get(kHeartbeatMs))) {
      controller.reset();
      Set(kControl, 0);
    }
    if (taken_by_another || (controller && !IsController(from)) ||
        (!controller && at != kControl)) {
      return kAccessDenied;
    }
    if (IsController(from)) {
      last_heard = Clock::now();
    }
    Set(at, value);
    if (at == kControl) {
      controller = value != 0 ? std::optional(from) : std::nullopt;
      last_heard = Clock::now();
    } else if (at == kTriggerSoftware && Get(kAcquisition) == 1 &&
               Get(kTriggerSource) == 0) {
      triggered = true;
    }
    SetPayload();
    return 0;
  }

  void Answer(UdpSocket& from_socket) {
    std::array<std::uint8_t, 2048> request{};
    sockaddr_in from{};
    const std::size_t size = from_socket.Receive(request, from);
    std::unique_lock lock(mutex);
    if (size < 8 || request[0] != 0x42 || silent) {
      return;
    }
    const auto command = static_cast<std::uint16_t>(Take(&request[2], 2));
    const std::uint32_t at = size >= 12 ? Take(&request[8], 4) : 0;
    Bytes data;
    std::uint16_t status = 0;
    switch (command) {
      case kDiscovery:
        data.assign(memory.begin(), memory.begin() + kDiscoveryBytes);
        break;
      case kReadRegister:
        status = at > kMemoryBytes - 4 ? kBadAddress : 0;
        Put(data, status == 0 ? Get(at) : 0, 4);
        if (at == kControl && IsController(from)) {
          last_heard = Clock::now();
        }
        break;
      case kReadMemory: {
        const std::uint32_t count = size >= 16 ? Take(&request[14], 2) : 0;
        status = at > kMemoryBytes - count ? kBadAddress : 0;
        Put(data, at, 4);
        if (status == 0) {
          Append(data, &memory[at], &memory[at] + count);
        }
        break;
      }
      case kWriteRegister:
        status = size >= 16 ? Write(at, Take(&request[12], 4), from) : kBadAddress;
        Put(data, 1, 4);
        break;
      case kResend:
        return;
      default:
        status = kNotImplemented;
    }
    if (triggered && unplug_for) {
      triggered = false;
      Trigger(lock);
      return;
    }
    Bytes answer;
    Put(answer, status, 2);
    Put(answer, command + 1U, 2);
    Put(answer, static_cast<std::uint32_t>(data.size()), 2);
    Append(answer, &request[6], &request[8]);
    Append(answer, data.data(), data.data() + data.size());
    control.Send(answer, from);
    if (triggered) {
      triggered = false;
      Trigger(lock);
    }
  }

  void Trigger(std::unique_lock<std::mutex>& lock) {
    if (unplug_for) {
      silent = true;
      back_at = Clock::now() + *unplug_for;
      unplug_for.reset();
      return;
    }
    CameraFault fault = CameraFault::kNone;
    if (!script.empty()) {
      fault = script.front();
      script.pop_front();
    }
    if (fault != CameraFault::kNoFrame) {
      SendFrame(fault, lock);
    }
  }

  // Which may take a while: the control channel's registers stay free meanwhile.
  std::vector<std::uint16_t> Picture(std::unique_lock<std::mutex>& lock) const {
    if (!options.picture) {
      return {};
    }
    const std::uint64_t number = Get(kUserDefinedValue);
    const double exposure_us = Get(kExposure);
    lock.unlock();
    std::vector<std::uint16_t> picture = options.picture(number, exposure_us);
    lock.lock();
    Expect(picture.size() == static_cast<std::size_t>(options.width) *
                                 static_cast<std::size_t>(options.height),
           "a count for each pixel of the sensor");
    return picture;
  }

  Bytes Image(const std::vector<std::uint16_t>& picture) const {
    const int bits = BitsPerPixel();
    const std::uint32_t code = Get(kPixelFormat);
    const bool is_deep = code == 0x01100007 || code == 0x01100031;
    const std::uint32_t max = is_deep                       ? 0xFFFF
                              : bits % 8 == 0 && bits != 16 ? 0xFF
                                                            : 0xFFF;
    const int samples = bits == 24 ? 3 : 1;
    const double exposure_us = Get(kExposure);
    Bytes image;
    std::uint32_t even = 0;  // of a pair of 12-bit counts
    const auto left = static_cast<int>(Get(kOffsetX)) * samples;
    const auto top = static_cast<int>(Get(kOffsetY));
    const auto width = static_cast<int>(Get(kWidth)) * samples;
    for (int y = 0; y < static_cast<int>(Get(kHeight)); ++y) {
      for (int x = 0; x < width; ++x) {
        const std::uint32_t count =
            std::min(max,
                     picture.empty() ? options.count(x + left, y + top, exposure_us)
                                     : std::uint32_t{picture[static_cast<std::size_t>(
                                           (y + top) * options.width + x + left)]});
        if (bits == 12 && x % 2 == 0) {
          even = count;
        } else if (bits == 12) {
          image.push_back(static_cast<std::uint8_t>(even));
          image.push_back(static_cast<std::uint8_t>(even >> 8 | (count & 0xF) << 4));
          image.push_back(static_cast<std::uint8_t>(count >> 4));
        } else {
          image.push_back(static_cast<std::uint8_t>(count));
          if (bits == 16) {
            image.push_back(static_cast<std::uint8_t>(count >> 8));
          }
        }
      }
    }
    return image;
  }

  Bytes StreamPacket(int type, std::uint32_t number) const {
    Bytes packet;
    Put(packet, 0, 2);
    Put(packet, frame_id, 2);
    Put(packet, static_cast<std::uint32_t>(type) << 24 | number, 4);
    return packet;
  }

  void SendPacket(const Bytes& packet) {
    stream.Send(packet,
                UdpSocket::Name(Get(kStreamAddress),
                                static_cast<std::uint16_t>(Get(kStreamPort))));
  }

  void SendFrame(CameraFault fault, std::unique_lock<std::mutex>& lock) {
    const Bytes image = Image(Picture(lock));
    if (silent) {
      return;  // unplugged while it exposed
    }
    const int steps = fault == CameraFault::kSkipId ? 2 : 1;
    for (int step = 0; step < steps; ++step) {
      frame_id = static_cast<std::uint16_t>(frame_id + 1);
      frame_id = frame_id == 0 ? std::uint16_t{1} : frame_id;
    }
    const auto now_ns =
        static_cast<std::uint64_t>(Clock::now().time_since_epoch().count());
    std::vector<Bytes> packets{StreamPacket(1, 0)};
    Put(packets[0], 1, 4);  // an image
    Put(packets[0], static_cast<std::uint32_t>(now_ns >> 32), 4);
    Put(packets[0], static_cast<std::uint32_t>(now_ns), 4);
    for (const std::uint32_t at : {kPixelFormat, kWidth, kHeight, kOffsetX, kOffsetY}) {
      Put(packets[0], Get(at), 4);
    }
    Put(packets[0], 0, 4);  // no padding
    const std::size_t room = (Get(kPacketSize) & 0xFFFF) - kPacketOverhead;
    std::uint32_t number = 1;
    for (std::size_t begin = 0; begin < image.size(); begin += room, ++number) {
      Bytes& packet = packets.emplace_back(StreamPacket(3, number));
      Append(packet,
             image.data() + begin,
             image.data() + std::min(begin + room, image.size()));
    }
    Bytes& trailer = packets.emplace_back(StreamPacket(2, number));
    Put(trailer, 1, 4);
    Put(trailer, Get(kHeight), 4);
    ++frames_sent;
    if (fault == CameraFault::kDropPacket) {
      packets.erase(packets.begin() + static_cast<std::ptrdiff_t>(packets.size() / 2));
    }
    for (const Bytes& packet : packets) {
      SendPacket(packet);
    }
  }

  void Run() {
    while (!stopping) {
      std::array<pollfd, 2> ready{
          {{control.fd(), POLLIN, 0}, {broadcast.fd(), POLLIN, 0}}};
      poll(ready.data(), ready.size(), 20);
      {
        const std::lock_guard lock(mutex);
        if (back_at && Clock::now() >= *back_at) {
          back_at.reset();
          PowerOn();
        }
      }
      if ((ready[0].revents & POLLIN) != 0) {
        Answer(control);
      }
      if ((ready[1].revents & POLLIN) != 0) {
        Answer(broadcast);
      }
    }
  }

  const GigeCameraTwinOptions options;
  const std::string xml;
  UdpSocket control;
  UdpSocket broadcast;
  UdpSocket stream;
  std::uint32_t address = 0;
  std::string address_text;
  std::atomic<bool> stopping = false;
  std::thread thread;

  mutable std::mutex mutex;  // of all below
  Bytes memory;
  std::optional<sockaddr_in> controller;
  Clock::time_point last_heard;
  bool silent = false;
  bool triggered = false;
  bool taken_by_another = false;
  std::optional<std::chrono::milliseconds> unplug_for;
  std::optional<Clock::time_point> back_at;
  std::deque<CameraFault> script;
  std::uint16_t frame_id = 0;
  std::int64_t frames_sent = 0;
};

GigeCameraTwin::GigeCameraTwin(const GigeCameraTwinOptions& options)
    : parts_(std::make_unique<Parts>(options)) {}
GigeCameraTwin::~GigeCameraTwin() = default;

const std::string& GigeCameraTwin::address() const {
  return parts_->address_text;
}

void GigeCameraTwin::Script(std::vector<CameraFault> faults) {
  const std::lock_guard lock(parts_->mutex);
  parts_->script.assign(faults.begin(), faults.end());
}

void GigeCameraTwin::Unplug() {
  const std::lock_guard lock(parts_->mutex);
  parts_->silent = true;
}

void GigeCameraTwin::Plug() {
  const std::lock_guard lock(parts_->mutex);
  parts_->PowerOn();
}

void GigeCameraTwin::GiveControlAway() {
  const std::lock_guard lock(parts_->mutex);
  parts_->taken_by_another = true;
}

void GigeCameraTwin::UnplugAtNextTrigger(std::chrono::milliseconds away) {
  const std::lock_guard lock(parts_->mutex);
  parts_->unplug_for = away;
}

void GigeCameraTwin::PulseLine() {
  std::unique_lock lock(parts_->mutex);
  if (parts_->Get(kAcquisition) == 1 && parts_->Get(kTriggerSource) == 1) {
    parts_->Trigger(lock);
  }
}

std::int64_t GigeCameraTwin::frames_sent() const {
  const std::lock_guard lock(parts_->mutex);
  return parts_->frames_sent;
}

double GigeCameraTwin::gain() const {
  const std::lock_guard lock(parts_->mutex);
  return parts_->Get(kGain);
}

}  // namespace nacre::rigs
