#include "acquire/helios_dac.h"

#include "acquire/internal/helios_usb.h"
#include "acquire/laser_watchdog.h"
#include "acquire/spot_frames.h"
#include "core/error.h"

#include <chrono>
#include <fmt/format.h>
#include <thread>

namespace nacre::acquire {
namespace {

using Clock = std::chrono::steady_clock;
using internal::HeliosUsb;
using internal::UsbPlace;

constexpr std::uint8_t kSdkVersion = 8;  // of the protocol that is spoken here
constexpr std::uint8_t kStartAtOnce = 1;
constexpr std::uint8_t kPlayOnce = 2;  // never left out: a frame without it loops
// After a stop the firmware drops frames for this long.
constexpr std::chrono::milliseconds kDeafAfterStop{100};
// Of a program that has just died: it has the DAC for a moment.
constexpr std::chrono::milliseconds kWaitForWatchdog{1500};
constexpr std::chrono::milliseconds kRetryPause{20};

std::vector<std::uint8_t> Encode(const LaserFrame& frame) {
  std::vector<std::uint8_t> bytes;
  bytes.reserve(frame.points.size() * 7 + 5);
  for (const LaserPoint& point : frame.points) {
    bytes.insert(bytes.end(),
                 {static_cast<std::uint8_t>(point.x >> 4),
                  static_cast<std::uint8_t>((point.x & 0xF) << 4 | point.y >> 8),
                  static_cast<std::uint8_t>(point.y),
                  point.r,
                  point.g,
                  point.b,
                  point.intensity});
  }
  const std::size_t count = frame.points.size();
  bytes.insert(
      bytes.end(),
      {static_cast<std::uint8_t>(frame.points_per_s),
       static_cast<std::uint8_t>(frame.points_per_s >> 8),
       static_cast<std::uint8_t>(count),
       static_cast<std::uint8_t>(count >> 8),
       static_cast<std::uint8_t>(kPlayOnce | (frame.at_once ? kStartAtOnce : 0))});
  return bytes;
}

std::string Wanted(const std::string& name) {
  return name.empty() ? "the only laser DAC" : "laser DAC " + name;
}

// Empty if it isn't there; `others` says what is.
std::unique_ptr<HeliosUsb> Seek(const std::string& name,
                                std::string& others,
                                bool& any_busy) {
  std::unique_ptr<HeliosUsb> found;
  for (const UsbPlace place : internal::FindHeliosPlaces()) {
    auto dac = std::make_unique<HeliosUsb>(place);
    if (!dac->Claim()) {
      any_busy = true;
      others += fmt::format(
          " one at {}:{} that another program has,", place.bus, place.address);
      continue;
    }
    dac->Drain();
    const std::string its_name = dac->Name();
    if (!name.empty() && its_name != name) {
      others += " " + its_name + ",";
      continue;
    }
    if (found) {
      throw DeviceError(
          fmt::format("{}: there are several, at USB {}:{} and {}:{}; unplug all but "
                      "the one that is meant",
                      Wanted(name),
                      found->place().bus,
                      found->place().address,
                      place.bus,
                      place.address));
    }
    found = std::move(dac);
  }
  return found;
}

std::unique_ptr<HeliosUsb> Open(const std::string& name) {
  const auto give_up = Clock::now() + kWaitForWatchdog;
  for (;;) {
    std::string others;
    bool any_busy = false;
    if (auto found = Seek(name, others, any_busy)) {
      return found;
    }
    if (any_busy && Clock::now() < give_up) {
      std::this_thread::sleep_for(kRetryPause);
      continue;
    }
    if (!others.empty()) {
      others.pop_back();
    }
    throw DeviceError(
        fmt::format("{}: not found; there is{}. See to its cable; nacre "
                    "doctor lists what is plugged in",
                    Wanted(name),
                    others.empty() ? " none" : others));
  }
}

}  // namespace

std::vector<FoundDac> FindHeliosDacs() {
  std::vector<FoundDac> found;
  for (const UsbPlace place : internal::FindHeliosPlaces()) {
    FoundDac dac;
    dac.bus = place.bus;
    dac.address = place.address;
    try {
      HeliosUsb usb(place);
      if (usb.Claim()) {
        usb.Drain();
        dac.name = usb.Name();
        dac.firmware = usb.Firmware();
      } else {
        dac.trouble = "another program has it";
      }
    } catch (const Error& e) {
      dac.trouble = e.what();
    }
    found.push_back(std::move(dac));
  }
  return found;
}

void NameHeliosDac(int bus, int address, const std::string& name) {
  HeliosUsb usb({bus, address});
  if (!usb.Claim()) {
    throw DeviceError(
        fmt::format("laser DAC at USB {}:{}: another program has it", bus, address));
  }
  usb.SetName(name);
}

struct HeliosDac::Parts {
  explicit Parts(const std::string& wanted)
      : usb(Open(wanted)), watchdog(usb->place().bus, usb->place().address) {
    usb->SetSdkVersion(kSdkVersion);
    name = usb->Name();
    firmware = usb->Firmware();
    usb->SetShutter(false);
    hears_from = Clock::now() + kDeafAfterStop;  // a watch-dog may just have stopped it
  }
  ~Parts() {
    try {
      usb->Stop();
      usb->SetShutter(false);
      watchdog.Release();
    } catch (const Error&) {
      // Not released: it tries the same as soon as the device is free.
    }
    usb.reset();
  }

  std::unique_ptr<HeliosUsb> usb;
  LaserWatchdog watchdog;
  std::string name;
  std::uint32_t firmware = 0;
  Clock::time_point hears_from;
};

HeliosDac::HeliosDac(const std::string& name) : parts_(std::make_unique<Parts>(name)) {}
HeliosDac::~HeliosDac() = default;

const std::string& HeliosDac::name() const {
  return parts_->name;
}
std::uint32_t HeliosDac::firmware() const {
  return parts_->firmware;
}

bool HeliosDac::IsReady() {
  if (!parts_->watchdog.IsAlive()) {
    throw DeviceError("the laser's watch-dog has ended; without it no laser stays on");
  }
  return parts_->usb->IsReady() && Clock::now() >= parts_->hears_from;
}

void HeliosDac::Stop() {
  parts_->usb->Stop();
  parts_->hears_from = Clock::now() + kDeafAfterStop;
}

void HeliosDac::SetShutter(bool open) {
  parts_->usb->SetShutter(open);
}

void HeliosDac::Write(const LaserFrame& frame) {
  Expect(IsGoodPointCount(static_cast<int>(frame.points.size())),
         "a size of frame that the firmware takes whole");
  parts_->usb->WriteFrame(Encode(frame));
}

}  // namespace nacre::acquire
