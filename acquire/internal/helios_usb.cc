#include "acquire/internal/helios_usb.h"

#include "core/error.h"

#include <algorithm>
#include <array>
#include <fmt/format.h>
#include <libusb.h>
#include <utility>

namespace nacre::acquire::internal {
namespace {

constexpr std::uint16_t kVendor = 0x1209;
constexpr std::uint16_t kProduct = 0xE500;
constexpr int kInterface = 0;
constexpr int kAlternateSetting = 1;  // 0 has no endpoints
constexpr std::uint8_t kFrameOut = 0x02;
constexpr std::uint8_t kCommandOut = 0x06;
constexpr std::uint8_t kAnswerIn = 0x83;
constexpr unsigned kCommandTimeoutMs = 24;
constexpr unsigned kAnswerTimeoutMs = 48;
constexpr int kAnswerBytes = 32;
constexpr std::size_t kNameBytes = 30;

// What the device can be told by the command endpoint. 0xDE boots its loader and is not
// to be sent by anything but a program that replaces firmware.
enum Code : std::uint8_t {
  kStop = 0x01,
  kShutter = 0x02,
  kStatus = 0x03,
  kFirmware = 0x04,
  kGetName = 0x05,
  kSetName = 0x06,
  kSdkVersion = 0x07,
  kAnswer = 0x80,  // added to a command's code by its answer
};

class DeviceList {
 public:
  explicit DeviceList(libusb_context* context)
      : count_(libusb_get_device_list(context, &devices_)) {}
  ~DeviceList() {
    if (count_ >= 0) {
      libusb_free_device_list(devices_, 1);
    }
  }
  DeviceList(const DeviceList&) = delete;
  DeviceList& operator=(const DeviceList&) = delete;

  std::span<libusb_device*> Devices() const {
    return {devices_, count_ < 0 ? 0 : static_cast<std::size_t>(count_)};
  }

 private:
  libusb_device** devices_ = nullptr;
  ssize_t count_;
};

bool IsHelios(libusb_device* device) {
  libusb_device_descriptor descriptor{};
  return libusb_get_device_descriptor(device, &descriptor) == 0 &&
         descriptor.idVendor == kVendor && descriptor.idProduct == kProduct;
}

UsbPlace Place(libusb_device* device) {
  return {libusb_get_bus_number(device), libusb_get_device_address(device)};
}

libusb_context* NewContext() {
  libusb_context* context = nullptr;
  if (const int result = libusb_init(&context); result != 0) {
    throw DeviceError(fmt::format("the USB can't be reached: {}",
                                  libusb_strerror(static_cast<libusb_error>(result))));
  }
  return context;
}

}  // namespace

void HeliosUsb::Close::operator()(libusb_context* context) const {
  libusb_exit(context);
}
void HeliosUsb::Close::operator()(libusb_device_handle* handle) const {
  libusb_close(handle);
}

std::vector<UsbPlace> FindHeliosPlaces() {
  libusb_context* const context = NewContext();
  std::vector<UsbPlace> places;
  {
    const DeviceList list(context);
    for (libusb_device* device : list.Devices()) {
      if (IsHelios(device)) {
        places.push_back(Place(device));
      }
    }
  }
  libusb_exit(context);
  std::sort(places.begin(), places.end(), [](const UsbPlace& a, const UsbPlace& b) {
    return std::pair(a.bus, a.address) < std::pair(b.bus, b.address);
  });
  return places;
}

HeliosUsb::HeliosUsb(UsbPlace place) : place_(place), context_(NewContext()) {
  int result = LIBUSB_ERROR_NO_DEVICE;
  const DeviceList list(context_.get());
  for (libusb_device* device : list.Devices()) {
    if (IsHelios(device) && Place(device) == place) {
      libusb_device_handle* handle = nullptr;
      result = libusb_open(device, &handle);
      handle_.reset(handle);
    }
  }
  if (result == LIBUSB_ERROR_ACCESS) {
    throw DeviceError(fmt::format(
        "laser DAC at USB {}:{}: no permission to open it; install "
        "70-nacre-helios.rules (nacre doctor says where) and plug it in again",
        place.bus,
        place.address));
  }
  Checked(result, "opening it");
}

HeliosUsb::~HeliosUsb() {
  if (claimed_) {
    libusb_release_interface(handle_.get(), kInterface);
  }
}

bool HeliosUsb::Claim() {
  const int result = libusb_claim_interface(handle_.get(), kInterface);
  if (result == LIBUSB_ERROR_BUSY) {
    return false;
  }
  Checked(result, "claiming its interface");
  claimed_ = true;
  Checked(
      libusb_set_interface_alt_setting(handle_.get(), kInterface, kAlternateSetting),
      "choosing its alternate setting");
  return true;
}

void HeliosUsb::Drain() {
  constexpr unsigned kSoonMs = 3;
  std::array<std::uint8_t, kAnswerBytes> answer{};
  for (int count = 0, result = 0; result == 0;) {
    result = libusb_interrupt_transfer(
        handle_.get(), kAnswerIn, answer.data(), kAnswerBytes, &count, kSoonMs);
    if (result != LIBUSB_ERROR_TIMEOUT) {
      Checked(result, "reading what it says");
    }
  }
}

void HeliosUsb::Stop() {
  Command(std::array<std::uint8_t, 2>{kStop, 0}, "stopping it");
}

void HeliosUsb::SetShutter(bool open) {
  Command(
      std::array<std::uint8_t, 2>{kShutter, open ? std::uint8_t{1} : std::uint8_t{0}},
      open ? "opening its shutter" : "closing its shutter");
}

bool HeliosUsb::IsReady() {
  Command(std::array<std::uint8_t, 2>{kStatus, 0}, "asking for its status");
  const auto answer = Answer(kStatus, "reading its status");
  return answer.size() > 1 && answer[1] == 1;
}

std::uint32_t HeliosUsb::Firmware() {
  Command(std::array<std::uint8_t, 2>{kFirmware, 0}, "asking for its firmware");
  const auto answer = Answer(kFirmware, "reading its firmware's version");
  std::uint32_t version = 0;
  for (std::size_t k = 4; k >= 1; --k) {
    version = version << 8 | (k < answer.size() ? answer[k] : 0U);
  }
  return version;
}

std::string HeliosUsb::Name() {
  Command(std::array<std::uint8_t, 2>{kGetName, 0}, "asking for its name");
  const auto answer = Answer(kGetName, "reading its name");
  std::string name(answer.begin() + 1, answer.end());
  return name.substr(0, std::min(name.find('\0'), kNameBytes));
}

void HeliosUsb::SetName(const std::string& name) {
  if (name.empty() || name.size() > kNameBytes) {
    throw UsageError(fmt::format("a laser DAC's name has 1 to {} bytes; '{}' has {}",
                                 kNameBytes,
                                 name,
                                 name.size()));
  }
  std::array<std::uint8_t, kNameBytes + 2> bytes{kSetName};
  std::copy(name.begin(), name.end(), bytes.begin() + 1);
  Command(bytes, "naming it");
}

void HeliosUsb::SetSdkVersion(std::uint8_t version) {
  Command(std::array<std::uint8_t, 2>{kSdkVersion, version}, "greeting it");
}

void HeliosUsb::WriteFrame(std::span<const std::uint8_t> bytes) {
  std::vector<std::uint8_t> copy(bytes.begin(), bytes.end());  // libusb takes no const
  const auto timeout_ms = static_cast<unsigned>(8 + bytes.size() / 32);
  int written = 0;
  const int result = libusb_bulk_transfer(handle_.get(),
                                          kFrameOut,
                                          copy.data(),
                                          static_cast<int>(copy.size()),
                                          &written,
                                          timeout_ms);
  Checked(result, "sending it a frame");
  if (written != static_cast<int>(copy.size())) {
    throw DeviceError(
        fmt::format("laser DAC at USB {}:{}: took {} of a frame's {} bytes",
                    place_.bus,
                    place_.address,
                    written,
                    copy.size()));
  }
}

void HeliosUsb::Command(std::span<const std::uint8_t> bytes, const char* doing) {
  std::vector<std::uint8_t> copy(bytes.begin(), bytes.end());
  int written = 0;
  Checked(libusb_interrupt_transfer(handle_.get(),
                                    kCommandOut,
                                    copy.data(),
                                    static_cast<int>(copy.size()),
                                    &written,
                                    kCommandTimeoutMs),
          doing);
}

std::vector<std::uint8_t> HeliosUsb::Answer(std::uint8_t kind, const char* doing) {
  constexpr int kMostStale = 16;
  for (int attempt = 0; attempt < kMostStale; ++attempt) {
    std::vector<std::uint8_t> answer(kAnswerBytes);
    int count = 0;
    Checked(libusb_interrupt_transfer(handle_.get(),
                                      kAnswerIn,
                                      answer.data(),
                                      kAnswerBytes,
                                      &count,
                                      kAnswerTimeoutMs),
            doing);
    answer.resize(static_cast<std::size_t>(count));
    if (!answer.empty() && answer[0] == (kind | kAnswer)) {
      return answer;
    }
  }
  throw DeviceError(fmt::format("laser DAC at USB {}:{}: {}: it answers something else",
                                place_.bus,
                                place_.address,
                                doing));
}

void HeliosUsb::Checked(int result, const std::string& doing) {
  if (result >= 0) {
    return;
  }
  gone_ = gone_ || result == LIBUSB_ERROR_NO_DEVICE;
  if (result == LIBUSB_ERROR_PIPE && handle_) {  // a halted endpoint stays so
    libusb_clear_halt(handle_.get(), kFrameOut);
    libusb_clear_halt(handle_.get(), kCommandOut);
    libusb_clear_halt(handle_.get(), kAnswerIn);
  }
  throw DeviceError(fmt::format("laser DAC at USB {}:{}: {}: {}",
                                place_.bus,
                                place_.address,
                                doing,
                                libusb_strerror(static_cast<libusb_error>(result))));
}

}  // namespace nacre::acquire::internal
