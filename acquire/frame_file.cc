#include "acquire/frame_file.h"

#include "core/error.h"
#include "core/simd_clones.h"
#include "core/write_all.h"

#include <algorithm>
#include <bit>
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

namespace {

// A header's length leaves the counts after it at any address.
using Word [[gnu::aligned(1), gnu::may_alias]] = std::uint16_t;

// Big endian, as PGM wants it.
NACRE_AVX2_CLONES void PutWords(const std::uint16_t* counts,
                                std::size_t count,
                                char* bytes) {
  auto* words = reinterpret_cast<Word*>(bytes);
  if constexpr (std::endian::native == std::endian::little) {
    for (std::size_t k = 0; k < count; ++k) {
      words[k] = static_cast<std::uint16_t>(counts[k] >> 8 | counts[k] << 8);
    }
  } else {
    for (std::size_t k = 0; k < count; ++k) {
      words[k] = counts[k];
    }
  }
}

}  // namespace

std::string EncodeFrame(const Frame& frame, int bit_depth) {
  std::string bytes;
  EncodeFrame(frame, bit_depth, bytes);
  return bytes;
}

void EncodeFrame(const Frame& frame, int bit_depth, std::string& bytes) {
  const std::size_t pixels =
      static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height);
  const bool is_color = frame.counts.size() == 3 * pixels && pixels > 0;
  Expect(is_color || frame.counts.size() == pixels, "a count or three a pixel");
  Expect(bit_depth >= 8 && bit_depth <= 16, "one or two bytes a count");
  const std::string header = fmt::format("{}\n{} {}\n{}\n",
                                         is_color ? "P6" : "P5",
                                         frame.width,
                                         frame.height,
                                         (1 << bit_depth) - 1);
  const std::size_t bytes_a_count = bit_depth > 8 ? 2 : 1;
  bytes.resize(header.size() + bytes_a_count * frame.counts.size());
  char* out = std::copy(header.begin(), header.end(), bytes.data());
  if (bytes_a_count == 2) {
    PutWords(frame.counts.data(), frame.counts.size(), out);
  } else {
    for (std::size_t k = 0; k < frame.counts.size(); ++k) {
      out[k] = static_cast<char>(frame.counts[k]);
    }
  }
}

Frame DecodeFrame(std::string_view bytes, const std::string& origin) {
  const bool is_color = bytes.starts_with("P6\n");
  if (!is_color && !bytes.starts_with("P5\n")) {
    throw BadData(origin + ": not a frame: no PGM header");
  }
  bytes.remove_prefix(3);
  Frame frame;
  frame.width = TakeNumber(bytes, origin);
  frame.height = TakeNumber(bytes, origin);
  const int max_count = TakeNumber(bytes, origin);
  const std::size_t count = static_cast<std::size_t>(frame.width) *
                            static_cast<std::size_t>(frame.height) * (is_color ? 3 : 1);
  const std::size_t bytes_a_count = max_count > 255 ? 2 : 1;
  if (max_count < 255 || bytes.size() != bytes_a_count * count) {
    throw BadData(
        fmt::format("{}: {} x {} pixels of {} counts of {} bytes were announced, but "
                    "{} bytes follow",
                    origin,
                    frame.width,
                    frame.height,
                    is_color ? 3 : 1,
                    bytes_a_count,
                    bytes.size()));
  }
  frame.counts.resize(count);
  const auto* in = reinterpret_cast<const unsigned char*>(bytes.data());
  std::uint16_t largest = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const auto value = bytes_a_count == 2
                           ? static_cast<std::uint16_t>(in[2 * k] << 8 | in[2 * k + 1])
                           : std::uint16_t{in[k]};
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
  const bool failed = !WriteAll(fd, bytes) || (durable && ::fdatasync(fd) != 0);
  const int error = errno;
  if (::close(fd) != 0 || failed) {
    errno = failed ? error : errno;
    throw SystemError("cannot write " + path.string());
  }
}

}  // namespace nacre::acquire
