#include "render/gzip.h"

#include "core/error.h"

#include <algorithm>
#include <array>
#include <fmt/format.h>
#include <limits>
#include <memory>
#include <zlib.h>

namespace nacre::render {
namespace {

constexpr int kGzipOnly = 16;  // zlib: with the header and checksum of gzip

}  // namespace

std::string Gunzip(std::string_view bytes,
                   const std::string& origin,
                   std::uint64_t max_bytes) {
  z_stream stream{};
  if (inflateInit2(&stream, MAX_WBITS + kGzipOnly) != Z_OK) {
    throw Error(origin + ": zlib can't be started: not enough memory?");
  }
  const std::unique_ptr<z_stream, void (*)(z_stream*)> owner(
      &stream, [](z_stream* s) { inflateEnd(s); });
  // zlib's interface takes no const, but doesn't write to its input.
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));  // NOLINT
  std::size_t left = bytes.size();
  std::string unpacked;
  auto buffer = std::make_unique<std::array<char, 1 << 16>>();
  int status = Z_OK;
  while (true) {
    if (stream.avail_in == 0) {
      const std::size_t step =
          std::min<std::size_t>(left, std::numeric_limits<uInt>::max());
      stream.avail_in = static_cast<uInt>(step);
      left -= step;
    }
    stream.next_out = reinterpret_cast<Bytef*>(buffer->data());
    stream.avail_out = static_cast<uInt>(buffer->size());
    status = inflate(&stream, Z_NO_FLUSH);
    unpacked.append(buffer->data(), buffer->size() - stream.avail_out);
    if (unpacked.size() > max_bytes) {
      throw BadData(
          fmt::format("{}: more than {} bytes once unpacked", origin, max_bytes));
    }
    if (status == Z_STREAM_END) {
      if (stream.avail_in == 0 && left == 0) {
        return unpacked;
      }
      inflateReset(&stream);
    } else if (status != Z_OK) {
      throw BadData(fmt::format("{}: damaged or cut short after {} unpacked bytes ({})",
                                origin,
                                unpacked.size(),
                                stream.msg != nullptr ? stream.msg : "end of file"));
    }
  }
}

}  // namespace nacre::render
