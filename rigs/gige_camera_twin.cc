#include "rigs/gige_camera_twin.h"

#include "core/error.h"
#include "rigs/internal/gige_frame.h"
#include "rigs/internal/gige_registers.h"
#include "rigs/internal/udp_socket.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <deque>
#include <fmt/format.h>
#include <mutex>
#include <optional>
#include <poll.h>
#include <random>
#include <thread>

namespace nacre::rigs {
namespace {

using Clock = std::chrono::steady_clock;
using namespace internal;  // NOLINT(google-build-using-namespace): forty names of
                           // registers

constexpr std::uint16_t kGvcpPort = 3956;
constexpr std::uint32_t kMemoryBytes = 0x20000;
constexpr std::uint32_t kDiscoveryBytes = 0xF8;

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

  void SetPayload() {
    Set(kPayload, Get(kWidth) * Get(kHeight) * BitsPerPixel(Get(kPixelFormat)) / 8);
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
    UdpSocket::Buffer request{};
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

  FrameHeader Header() const {
    return {.pixel_format = Get(kPixelFormat),
            .width = Get(kWidth),
            .height = Get(kHeight),
            .left = Get(kOffsetX),
            .top = Get(kOffsetY),
            .frame_id = frame_id};
  }

  Bytes Image(const std::vector<std::uint16_t>& picture) const {
    if (picture.empty()) {
      const double exposure_us = Get(kExposure);
      return PackCounts(Header(),
                        [&](int x, int y) { return options.count(x, y, exposure_us); });
    }
    return PackCounts(Header(), [&](int x, int y) {
      return std::uint32_t{
          picture[static_cast<std::size_t>(std::int64_t{y} * options.width + x)]};
    });
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
    std::vector<Bytes> packets =
        FramePackets(Header(), image, now_ns, Get(kPacketSize) & 0xFFFF);
    ++frames_sent;
    if (fault == CameraFault::kDropPacket) {
      packets.erase(packets.begin() + static_cast<std::ptrdiff_t>(packets.size() / 2));
    }
    const sockaddr_in to = UdpSocket::Name(
        Get(kStreamAddress), static_cast<std::uint16_t>(Get(kStreamPort)));
    for (const Bytes& packet : packets) {
      stream.Send(packet, to);
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
