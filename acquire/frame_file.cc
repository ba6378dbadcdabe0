#include "acquire/frame_file.h"

#include "core/error.h"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

namespace nacre::acquire {
namespace {

constexpr int kMaxSide = 1 << 16;

// Takes a decimal number and the single white space after it off the front.
int TakeNumber(std::string_view& bytes, const std::string& origin) {
  int value = 0;
  const auto [end, error] =
      std::from_chars(bytes.data(), bytes.data() + bytes.size(), value);
  const auto length = static_cast<std::size_t>(end - bytes.data());
  if (error != std::errc() || length >= bytes.size() ||
      (bytes[length] != '\n' && bytes[length] != ' ') || value < 1 ||
      value > kMaxSide) {
    throw BadData(origin + ": not a frame: bad PGM header");
  }
  bytes.remove_prefix(length + 1);
  return value;
}

}  // namespace

std::string FrameFileName(std::int64_t number) {
  return fmt::format("frames/{:06}.pgm", number);
}

std::string EncodeFrame(const Frame& frame, int bit_depth) {
  Expect(frame.counts.size() == static_cast<std::size_t>(frame.width) *
                                    static_cast<std::size_t>(frame.height),
         "width * height counts");
  Expect(bit_depth > 8 && bit_depth <= 16, "two bytes a count");
  std::string bytes =
      fmt::format("P5\n{} {}\n{}\n", frame.width, frame.height, (1 << bit_depth) - 1);
  std::size_t k = bytes.size();
  bytes.resize(k + 2 * frame.counts.size());
  for (const std::uint16_t count : frame.counts) {  // PGM is big endian
    bytes[k++] = static_cast<char>(count >> 8);
    bytes[k++] = static_cast<char>(count & 0xFF);
  }
  return bytes;
}

Frame DecodeFrame(std::string_view bytes, const std::string& origin) {
  if (!bytes.starts_with("P5\n")) {
    throw BadData(origin + ": not a frame: no PGM header");
  }
  bytes.remove_prefix(3);
  Frame frame;
  frame.width = TakeNumber(bytes, origin);
  frame.height = TakeNumber(bytes, origin);
  const int max_count = TakeNumber(bytes, origin);
  const std::size_t count =
      static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height);
  if (max_count < 256 || bytes.size() != 2 * count) {
    throw BadData(
        fmt::format("{}: {} x {} pixels of two bytes were announced, but {} "
                    "bytes follow",
                    origin,
                    frame.width,
                    frame.height,
                    bytes.size()));
  }
  frame.counts.resize(count);
  std::uint16_t largest = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const auto high = static_cast<unsigned char>(bytes[2 * k]);
    const auto low = static_cast<unsigned char>(bytes[2 * k + 1]);
    const auto value = static_cast<std::uint16_t>(high << 8 | low);
    frame.counts[k] = value;
    largest = std::max(largest, value);
  }
  if (largest > max_count) {
    throw BadData(fmt::format("{}: a count of {} is above the sensor's maximum of {}",
                              origin,
                              largest,
                              max_count));
  }
  return frame;
}

void WriteFrameFile(const std::filesystem::path& path,
                    std::string_view bytes,
                    bool durable) {
  const int fd = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (fd < 0) {
    throw SystemError("cannot write " + path.string());
  }
  bool failed = false;
  while (!bytes.empty() && !failed) {
    const ssize_t written = ::write(fd, bytes.data(), bytes.size());
    if (written >= 0) {
      bytes.remove_prefix(static_cast<std::size_t>(written));
    } else {
      failed = errno != EINTR;
    }
  }
  failed = failed || (durable && ::fdatasync(fd) != 0);
  const int error = errno;
  if (::close(fd) != 0 || failed) {
    errno = failed ? error : errno;
    throw SystemError("cannot write " + path.string());
  }
}

}  // namespace nacre::acquire
