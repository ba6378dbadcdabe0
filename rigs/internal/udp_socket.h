#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <netinet/in.h>
#include <vector>

namespace nacre::rigs::internal {

using Bytes = std::vector<std::uint8_t>;

/// Appends the `byte_count` (at most 4) lowest bytes of value, the highest first.
void Put(Bytes& bytes, std::uint32_t value, int byte_count);

void Append(Bytes& bytes, const std::uint8_t* begin, const std::uint8_t* end);

/// What `Put` wrote.
std::uint32_t Take(const std::uint8_t* bytes, int byte_count);

/// A datagram socket that never waits.
class UdpSocket {
 public:
  using Buffer = std::array<std::uint8_t, 2048>;

  UdpSocket();  ///< throws SystemError
  ~UdpSocket();
  UdpSocket(const UdpSocket&) = delete;
  UdpSocket& operator=(const UdpSocket&) = delete;

  int fd() const { return fd_; }

  /// False if the address is taken.
  bool Bind(std::uint32_t address, std::uint16_t port);
  /// Others may bind to the same address.
  void ShareAddress();
  /// What the network loses is lost, as with any camera.
  void Send(const Bytes& bytes, const sockaddr_in& to);
  /// Bytes received; 0 if none wait.
  std::size_t Receive(Buffer& bytes, sockaddr_in& from);

  static sockaddr_in Name(std::uint32_t address, std::uint16_t port);

 private:
  int fd_;
};

}  // namespace nacre::rigs::internal
