#include "cli/network_check.h"

#include "core/file_descriptor.h"

#include <arpa/inet.h>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <optional>
#include <poll.h>
#include <string>
#include <sys/socket.h>
#include <thread>
#include <unistd.h>

namespace nacre::cli {
namespace {

using SteadyClock = std::chrono::steady_clock;
using State = Finding::State;

constexpr std::size_t kPayloadBytes = 8972;  // of 9000, without IP and UDP headers
constexpr int kPackets = 234;                // of a frame of 1024 x 1024 x 16 bits
constexpr int kFrames = 100;
constexpr int kBufferBytes = 4'000'000;  // AravisOptions' default
constexpr std::chrono::milliseconds kTime{300};

struct Loss {
  int frames = 0;
  int incomplete = 0;
  double seconds = 0;
  int buffer_bytes = 0;
};

// Receives one frame's packets; false if some never came.
bool ReceiveFrame(int fd) {
  std::array<char, kPayloadBytes> packet;
  for (int got = 0; got < kPackets; ++got) {
    pollfd ready{fd, POLLIN, 0};
    if (::poll(&ready, 1, 20) <= 0 || ::recv(fd, packet.data(), packet.size(), 0) < 0) {
      return false;
    }
  }
  return true;
}

// Empty if this machine has no loopback to bind to.
std::optional<Loss> Measure() {
  const FileDescriptor receiver(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  const FileDescriptor sender(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t length = sizeof address;
  auto* name = reinterpret_cast<sockaddr*>(&address);
  if (receiver.fd() < 0 || sender.fd() < 0 ||
      ::bind(receiver.fd(), name, sizeof address) != 0 ||
      ::getsockname(receiver.fd(), name, &length) != 0 ||
      ::connect(sender.fd(), name, sizeof address) != 0) {
    return std::nullopt;
  }
  ::setsockopt(
      receiver.fd(), SOL_SOCKET, SO_RCVBUF, &kBufferBytes, sizeof kBufferBytes);
  Loss loss;
  length = sizeof loss.buffer_bytes;
  ::getsockopt(receiver.fd(), SOL_SOCKET, SO_RCVBUF, &loss.buffer_bytes, &length);
  loss.buffer_bytes /= 2;  // the kernel doubles what it is asked for, and tells so
  const auto start = SteadyClock::now();
  for (; loss.frames < kFrames && SteadyClock::now() - start < kTime; ++loss.frames) {
    std::thread burst([&sender] {
      const std::array<char, kPayloadBytes> packet{};
      for (int k = 0; k < kPackets; ++k) {
        (void)!::send(sender.fd(), packet.data(), packet.size(), 0);
      }
    });
    loss.incomplete += ReceiveFrame(receiver.fd()) ? 0 : 1;
    burst.join();
    std::array<char, kPayloadBytes> late;
    while (::recv(receiver.fd(), late.data(), late.size(), MSG_DONTWAIT) >= 0) {
    }
  }
  loss.seconds = std::chrono::duration<double>(SteadyClock::now() - start).count();
  return loss;
}

}  // namespace

std::vector<Finding> CheckLoopback() {
  const std::optional<Loss> loss = Measure();
  if (!loss) {
    return {{"network",
             "loopback",
             "not there",
             State::kNote,
             "cameras' twins and the preview need it: ip link set dev lo up"}};
  }
  const bool whole = loss->incomplete == 0;
  return {{"network",
           "bandwidth",
           fmt::format("{:.0f} MB/s over loopback, {} of {} frames of 2 MB incomplete "
                       "with a buffer of {} kB",
                       1e-6 * loss->frames * kPackets *
                           static_cast<double>(kPayloadBytes) / loss->seconds,
                       loss->incomplete,
                       loss->frames,
                       loss->buffer_bytes / 1000),
           whole ? State::kGood : State::kNote,
           whole ? ""
                 : "for a GigE camera: sysctl -w net.core.rmem_max=33554432, and end "
                   "what keeps all cores busy"}};
}

std::vector<Finding> CheckDiskSpeed(const std::filesystem::path& folder) {
  std::string path = (folder / ".nacre-doctor-XXXXXX").string();
  const int fd = ::mkstemp(path.data());
  if (fd < 0) {
    return {{"disk",
             "writing",
             std::strerror(errno),
             State::kProblem,
             "sessions can't be written in " + folder.string()}};
  }
  ::unlink(path.c_str());
  const std::string block(std::size_t{1} << 20, 'n');
  const auto start = SteadyClock::now();
  std::size_t written = 0;
  for (int k = 0; k < 64 && SteadyClock::now() - start < kTime; ++k) {
    const ssize_t count = ::write(fd, block.data(), block.size());
    written += count > 0 ? static_cast<std::size_t>(count) : 0;
  }
  ::fdatasync(fd);
  const double seconds =
      std::chrono::duration<double>(SteadyClock::now() - start).count();
  ::close(fd);
  const double speed = static_cast<double>(written) * 1e-6 / seconds;
  constexpr double kCameraMbPerS = 100;  // a gigabit of Ethernet
  const bool fast = speed > kCameraMbPerS;
  return {{"disk",
           "writing",
           fmt::format("{:.0f} MB/s, flushed", speed),
           fast ? State::kGood : State::kNote,
           fast ? ""
                : "slower than a GigE camera may send: capture waits for the disk; "
                  "capture to a faster one"}};
}

}  // namespace nacre::cli
