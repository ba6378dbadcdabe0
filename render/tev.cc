#include "render/tev.h"

#include "core/error.h"

#include <algorithm>
#include <bit>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <fmt/format.h>
#include <memory>
#include <netdb.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

namespace nacre::render {
namespace {

static_assert(std::endian::native == std::endian::little, "the protocol's byte order");

constexpr const char* kDefaultPort = "14158";
constexpr std::uint8_t kCreateImage = 4;
constexpr std::uint8_t kUpdateImage = 6;  // its third version
constexpr int kTimeoutSeconds = 5;
constexpr std::size_t kPacketBytes = std::size_t{1} << 20;

class Packet {
 public:
  Packet() : bytes_(sizeof(std::uint32_t), '\0') {}
  template <class T>
  void Add(T value) {
    const std::size_t at = bytes_.size();
    bytes_.resize(at + sizeof(T));
    std::memcpy(&bytes_[at], &value, sizeof(T));
  }
  void AddText(const std::string& text) {
    bytes_ += text;
    bytes_ += '\0';
  }
  void AddFloats(const float* values, std::size_t count) {
    const std::size_t at = bytes_.size();
    bytes_.resize(at + count * sizeof(float));
    std::memcpy(&bytes_[at], values, count * sizeof(float));
  }
  /// With its length, which counts itself, first.
  std::string Finish() && {
    const auto size = static_cast<std::uint32_t>(bytes_.size());
    std::memcpy(bytes_.data(), &size, sizeof(size));
    return std::move(bytes_);
  }

 private:
  std::string bytes_;
};

Packet Begin(std::uint8_t type, bool grab_focus, const std::string& name) {
  Packet packet;
  packet.Add(type);
  packet.Add(static_cast<std::uint8_t>(grab_focus));
  packet.AddText(name);
  return packet;
}

void CheckPort(const std::string& address, const std::string& port) {
  int number = 0;
  const auto [end, error] =
      std::from_chars(port.data(), port.data() + port.size(), number);
  if (error != std::errc() || end != port.data() + port.size() || number < 1 ||
      number > 65535) {
    throw UsageError(
        fmt::format("'{}' isn't HOST:PORT, with a port from 1 to 65535", address));
  }
}

// A socket that neither takes nor gives may not hold up a picture for long.
void SetTimeout(int socket) {
  const timeval timeout{kTimeoutSeconds, 0};
  setsockopt(socket, SOL_SOCKET, SO_SNDTIMEO, &timeout, sizeof(timeout));
}

}  // namespace

TevDisplay::TevDisplay(const std::string& address) {
  const std::size_t colon = address.rfind(':');
  std::string host = address.substr(0, colon);
  std::string port = kDefaultPort;
  if (colon != std::string::npos) {
    port = address.substr(colon + 1);
    CheckPort(address, port);
  }
  host = host.empty() ? "localhost" : host;
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  const int failure = getaddrinfo(host.c_str(), port.c_str(), &hints, &found);
  const std::unique_ptr<addrinfo, void (*)(addrinfo*)> owner(found, [](addrinfo* list) {
    if (list != nullptr) {
      freeaddrinfo(list);
    }
  });
  std::string why = failure == 0 ? "" : gai_strerror(failure);
  for (const addrinfo* at = found; at != nullptr && socket_ < 0; at = at->ai_next) {
    const int tried = socket(at->ai_family, at->ai_socktype, at->ai_protocol);
    if (tried < 0) {
      why = std::strerror(errno);
      continue;
    }
    SetTimeout(tried);
    if (connect(tried, at->ai_addr, at->ai_addrlen) == 0) {
      socket_ = tried;
    } else {
      why = std::strerror(errno);
      close(tried);
    }
  }
  if (socket_ < 0) {
    throw DeviceError(fmt::format(
        "no tev at {}:{} ({}): start it first, or leave out --tev", host, port, why));
  }
}

TevDisplay::~TevDisplay() {
  if (socket_ >= 0) {
    close(socket_);
  }
}

bool TevDisplay::Show(const std::string& name, const ExrPart& image) {
  if (name != created_) {
    if (!Send(TevCreatePacket(name, image))) {
      return false;
    }
    created_ = name;
  }
  const std::size_t row =
      static_cast<std::size_t>(image.width) * image.channels.size() * sizeof(float);
  const int rows = static_cast<int>(
      std::max<std::size_t>(1, kPacketBytes / std::max<std::size_t>(row, 1)));
  for (int first = 0; first < image.height; first += rows) {
    const int count = std::min(rows, image.height - first);
    if (!Send(TevUpdatePacket(name, image, first, count))) {
      return false;
    }
  }
  return true;
}

bool TevDisplay::Send(const std::string& packet) {
  for (std::size_t sent = 0; socket_ >= 0 && sent < packet.size();) {
    const ssize_t now =
        send(socket_, packet.data() + sent, packet.size() - sent, MSG_NOSIGNAL);
    if (now > 0) {
      sent += static_cast<std::size_t>(now);
    } else if (errno != EINTR) {
      close(socket_);
      socket_ = -1;
    }
  }
  return socket_ >= 0;
}

std::string TevCreatePacket(const std::string& name, const ExrPart& image) {
  Packet packet = Begin(kCreateImage, true, name);
  packet.Add<std::int32_t>(image.width);
  packet.Add<std::int32_t>(image.height);
  packet.Add(static_cast<std::int32_t>(image.channels.size()));
  for (const std::string& channel : image.channels) {
    packet.AddText(channel);
  }
  return std::move(packet).Finish();
}

std::string TevUpdatePacket(const std::string& name,
                            const ExrPart& image,
                            int first,
                            int count) {
  Expect(first >= 0 && count > 0 && first + count <= image.height,
         "rows of the picture");
  Packet packet = Begin(kUpdateImage, false, name);
  packet.Add(static_cast<std::int32_t>(image.channels.size()));
  for (const std::string& channel : image.channels) {
    packet.AddText(channel);
  }
  packet.Add(std::int32_t{0});
  packet.Add<std::int32_t>(first);
  packet.Add<std::int32_t>(image.width);
  packet.Add<std::int32_t>(count);
  const auto width = static_cast<std::size_t>(image.width);
  const std::size_t values = width * static_cast<std::size_t>(count);
  for (std::size_t c = 0; c < image.channels.size(); ++c) {
    packet.Add(static_cast<std::int64_t>(c * values));  // where the channel begins
  }
  for (std::size_t c = 0; c < image.channels.size(); ++c) {
    packet.Add(std::int64_t{1});  // from pixel to pixel
  }
  for (std::size_t c = 0; c < image.channels.size(); ++c) {
    packet.AddFloats(image.Channel(c) + static_cast<std::size_t>(first) * width,
                     values);
  }
  return std::move(packet).Finish();
}

}  // namespace nacre::render
