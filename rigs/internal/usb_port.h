#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace nacre::rigs::internal {

/// How a device answers a transfer to it.
enum class UsbAnswer { kDone, kStall, kLater };

/// What a device does beyond being a device. Called from the USB's threads.
class UsbFunction {
 public:
  virtual ~UsbFunction() = default;
  virtual UsbAnswer Out(std::uint8_t endpoint, std::span<const std::uint8_t> bytes) = 0;
  /// Empty if it has nothing to say yet.
  virtual std::optional<std::vector<std::uint8_t>> In(std::uint8_t endpoint) = 0;
};

/// A port of the emulated USB with a Helios' descriptors in it: sysfs, hotplug events
/// and usbfs as libusb needs them. Several programs may open it, one may claim it.
class UsbPort {
 public:
  UsbPort(int port, UsbFunction& function);
  ~UsbPort();
  UsbPort(const UsbPort&) = delete;
  UsbPort& operator=(const UsbPort&) = delete;

  void Plug();
  void Unplug();
  /// Transfers that were put off are tried again.
  void Retry();

 private:
  struct Parts;
  std::shared_ptr<Parts> parts_;
};

bool CanEmulateUsb();

}  // namespace nacre::rigs::internal
