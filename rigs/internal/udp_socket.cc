#include "rigs/internal/udp_socket.h"

#include "core/error.h"

#include <sys/socket.h>
#include <unistd.h>

namespace nacre::rigs::internal {

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

UdpSocket::UdpSocket()
    : fd_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
  if (fd_ < 0) {
    throw SystemError("camera twin: a UDP socket");
  }
}

UdpSocket::~UdpSocket() {
  close(fd_);
}

bool UdpSocket::Bind(std::uint32_t address, std::uint16_t port) {
  const sockaddr_in name = Name(address, port);
  return bind(fd_, reinterpret_cast<const sockaddr*>(&name), sizeof name) == 0;
}

void UdpSocket::ShareAddress() {
  const int on = 1;
  setsockopt(fd_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
}

void UdpSocket::Send(const Bytes& bytes, const sockaddr_in& to) {
  (void)!sendto(fd_,
                bytes.data(),
                bytes.size(),
                0,
                reinterpret_cast<const sockaddr*>(&to),
                sizeof to);
}

std::size_t UdpSocket::Receive(Buffer& bytes, sockaddr_in& from) {
  socklen_t length = sizeof from;
  const ssize_t count = recvfrom(
      fd_, bytes.data(), bytes.size(), 0, reinterpret_cast<sockaddr*>(&from), &length);
  return count > 0 ? static_cast<std::size_t>(count) : 0;
}

sockaddr_in UdpSocket::Name(std::uint32_t address, std::uint16_t port) {
  sockaddr_in name{};
  name.sin_family = AF_INET;
  name.sin_addr.s_addr = htonl(address);
  name.sin_port = htons(port);
  return name;
}

}  // namespace nacre::rigs::internal
