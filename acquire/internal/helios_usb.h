#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

struct libusb_context;
struct libusb_device_handle;

namespace nacre::acquire::internal {

/// Where a device is on this machine's USB; another place each time it is plugged in.
struct UsbPlace {
  int bus = 0;
  int address = 0;
  friend bool operator==(const UsbPlace&, const UsbPlace&) = default;
};

/// The Helios DACs that are plugged in, without opening them.
std::vector<UsbPlace> FindHeliosPlaces();

/// An open Helios DAC, spoken to by libusb. Closing it claims nothing and sends
/// nothing. All calls throw DeviceError naming the place and what libusb said.
class HeliosUsb {
 public:
  explicit HeliosUsb(UsbPlace place);
  ~HeliosUsb();
  HeliosUsb(const HeliosUsb&) = delete;
  HeliosUsb& operator=(const HeliosUsb&) = delete;

  UsbPlace place() const { return place_; }
  /// Whether a call found it unplugged.
  bool IsGone() const { return gone_; }

  /// Takes the interface and its alternate setting 1, for this program alone. False if
  /// another has it.
  bool Claim();

  /// Drops answers that a program before us didn't take.
  void Drain();

  void Stop();
  void SetShutter(bool open);
  bool IsReady();
  std::uint32_t Firmware();
  std::string Name();
  /// Up to 30 bytes.
  void SetName(const std::string& name);
  void SetSdkVersion(std::uint8_t version);
  /// A frame as it goes over the wire.
  void WriteFrame(std::span<const std::uint8_t> bytes);

 private:
  struct Close {
    void operator()(libusb_context* context) const;
    void operator()(libusb_device_handle* handle) const;
  };
  void Command(std::span<const std::uint8_t> bytes, const char* doing);
  // The answer whose first byte is `kind`; answers that nobody took are dropped.
  std::vector<std::uint8_t> Answer(std::uint8_t kind, const char* doing);
  void Checked(int result, const std::string& doing);

  UsbPlace place_;
  std::unique_ptr<libusb_context, Close> context_;
  std::unique_ptr<libusb_device_handle, Close> handle_;
  bool claimed_ = false;
  bool gone_ = false;
};

}  // namespace nacre::acquire::internal
