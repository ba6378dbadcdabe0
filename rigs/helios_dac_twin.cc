#include "rigs/helios_dac_twin.h"

#include "core/error.h"
#include "rigs/internal/helios_firmware.h"
#include "rigs/internal/usb_port.h"

#include <condition_variable>
#include <ctime>
#include <deque>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

namespace nacre::rigs {
namespace {

using namespace std::chrono_literals;
using internal::UsbAnswer;

constexpr std::uint8_t kFrameOut = 0x02;
constexpr std::uint8_t kCommandOut = 0x06;
constexpr std::uint8_t kAnswerIn = 0x83;

// Counts down to a fault; -1: none is due.
class Countdown {
 public:
  void Set(int count) { left_ = count; }
  bool IsNow() {
    if (left_ < 0) {
      return false;
    }
    return left_-- == 0;
  }

 private:
  int left_ = -1;
};

}  // namespace

std::int64_t MonotonicNs() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * std::int64_t{1'000'000'000} + now.tv_nsec;
}

bool CanEmulateUsb() {
  return internal::CanEmulateUsb();
}

struct HeliosDacTwin::Parts final : internal::UsbFunction {
  explicit Parts(const HeliosDacTwinOptions& options)
      : firmware(options), port(options.port, *this) {
    port.Plug();
    thread = std::jthread([this](const std::stop_token& stop) { Run(stop); });
  }
  ~Parts() override {
    thread.request_stop();
    woken.notify_all();
    thread.join();
    port.Unplug();
  }

  UsbAnswer Out(std::uint8_t endpoint, std::span<const std::uint8_t> bytes) override {
    const std::lock_guard lock(mutex);
    const std::int64_t now_ns = MonotonicNs();
    if (endpoint == kCommandOut) {
      firmware.Command(bytes, now_ns);
      return UsbAnswer::kDone;
    }
    if (endpoint != kFrameOut) {
      return UsbAnswer::kStall;
    }
    if (!firmware.HasRoom(now_ns)) {
      return UsbAnswer::kLater;
    }
    if (unplug.IsNow()) {
      pulled = true;
      woken.notify_all();
      return UsbAnswer::kLater;
    }
    if (stall.IsNow()) {
      return UsbAnswer::kStall;
    }
    firmware.Frame(bytes, now_ns);
    return UsbAnswer::kDone;
  }

  std::optional<std::vector<std::uint8_t>> In(std::uint8_t endpoint) override {
    const std::lock_guard lock(mutex);
    if (endpoint != kAnswerIn || firmware.answers().empty()) {
      return std::nullopt;
    }
    if (hang.IsNow()) {
      firmware.answers().pop_front();
      return std::nullopt;
    }
    auto answer = std::move(firmware.answers().front());
    firmware.answers().pop_front();
    return answer;
  }

  // Transfers that were answered "later" are tried again, and the plug is pulled, which
  // must not be done from within a transfer.
  void Run(const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      bool pull = false;
      {
        std::unique_lock lock(mutex);
        woken.wait_for(lock, stop, 500us, [this] { return pulled; });
        pull = std::exchange(pulled, false);
      }
      port.Retry();
      if (pull) {
        PullPlug();
        std::this_thread::sleep_for(away);
        port.Plug();
      }
    }
  }

  void PullPlug() {
    port.Unplug();
    const std::lock_guard lock(mutex);
    firmware.Reset(MonotonicNs());
  }

  mutable std::mutex mutex;  // of all but the port
  mutable internal::HeliosFirmware firmware;
  Countdown unplug;
  Countdown stall;
  Countdown hang;
  std::chrono::milliseconds away{0};
  bool pulled = false;
  std::condition_variable_any woken;
  internal::UsbPort port;
  std::jthread thread;
};

HeliosDacTwin::HeliosDacTwin(const HeliosDacTwinOptions& options)
    : parts_(std::make_unique<Parts>(options)) {}
HeliosDacTwin::~HeliosDacTwin() = default;

void HeliosDacTwin::Plug() {
  parts_->port.Plug();
}
void HeliosDacTwin::Unplug() {
  parts_->PullPlug();
}

void HeliosDacTwin::UnplugAfter(int frames, std::chrono::milliseconds away) {
  const std::lock_guard lock(parts_->mutex);
  parts_->unplug.Set(frames);
  parts_->away = away;
}
void HeliosDacTwin::StallAfter(int frames) {
  const std::lock_guard lock(parts_->mutex);
  parts_->stall.Set(frames);
}
void HeliosDacTwin::HangAfter(int answers) {
  const std::lock_guard lock(parts_->mutex);
  parts_->hang.Set(answers);
}

std::shared_ptr<const acquire::LaserFrame> HeliosDacTwin::Emitting() const {
  const std::lock_guard lock(parts_->mutex);
  return parts_->firmware.Emitting(MonotonicNs());
}
bool HeliosDacTwin::IsShutterOpen() const {
  const std::lock_guard lock(parts_->mutex);
  return parts_->firmware.IsShutterOpen();
}
std::string HeliosDacTwin::name() const {
  const std::lock_guard lock(parts_->mutex);
  return parts_->firmware.name();
}
DacCounts HeliosDacTwin::counts() const {
  const std::lock_guard lock(parts_->mutex);
  return parts_->firmware.counts();
}
std::vector<LitSpan> HeliosDacTwin::LitSpans() const {
  const std::lock_guard lock(parts_->mutex);
  return parts_->firmware.LitSpans(MonotonicNs());
}

}  // namespace nacre::rigs
