#include "reconstruct/internal/mat_elements.h"

#include "core/error.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <fmt/format.h>
#include <memory>
#include <optional>
#include <span>
#include <zlib.h>

namespace nacre::reconstruct {
namespace {

using Bytes = std::span<unsigned char>;

// MathWorks, "MAT-File Format", tables 1-1 and 1-3.
enum ElementType : std::uint32_t {
  kInt8 = 1,
  kUint8 = 2,
  kInt32 = 5,
  kUint32 = 6,
  kMatrix = 14,
  kCompressed = 15
};
enum ArrayClass : std::uint32_t {
  kCell = 1,
  kStruct = 2,
  kObject = 3,
  kSparse = 5,
  kFunction = 16,
  kOpaque = 17
};
constexpr std::uint64_t kTagBytes = 8;
constexpr std::uint64_t kMostAxes = 32;
constexpr int kMostLevels = 16;
constexpr std::uint64_t kMostNested = 1'000'000;  // libmatio takes 150 bytes for each
// deflate can't pack better than this.
constexpr std::uint64_t kMostPacking = 1032;

// The bytes of one element of a file, unpacked if they are packed.
class ElementBytes {
 public:
  ElementBytes(std::istream& file, std::uint64_t left, bool packed)
      : file_(file), left_(left) {
    if (packed) {
      if (inflateInit(&stream_.emplace()) != Z_OK) {
        throw Error("cannot unpack: zlib can't be started: not enough memory?");
      }
      owner_.reset(&*stream_);
    }
  }
  ElementBytes(const ElementBytes&) = delete;
  ElementBytes& operator=(const ElementBytes&) = delete;

  // False if there aren't so many.
  bool Read(Bytes to) { return stream_ ? Inflate(to) : ReadFile(to) == to.size(); }

  bool Skip(std::uint64_t count) {
    std::array<unsigned char, 4096> unused{};
    while (count > 0) {
      const auto step =
          static_cast<std::size_t>(std::min<std::uint64_t>(count, unused.size()));
      if (!Read(Bytes(unused.data(), step))) {
        return false;
      }
      count -= step;
    }
    return true;
  }

 private:
  std::size_t ReadFile(Bytes to) {
    const auto step = std::min<std::uint64_t>(to.size(), left_);
    file_.read(reinterpret_cast<char*>(to.data()), static_cast<std::streamsize>(step));
    left_ -= step;
    return static_cast<std::size_t>(file_.gcount());
  }

  bool Inflate(Bytes to) {
    stream_->next_out = to.data();
    stream_->avail_out = static_cast<uInt>(to.size());
    while (stream_->avail_out > 0) {
      if (stream_->avail_in == 0) {
        stream_->avail_in = static_cast<uInt>(ReadFile(buffer_));
        stream_->next_in = buffer_.data();
      }
      const int status = inflate(&*stream_, Z_NO_FLUSH);
      if (status != Z_OK) {  // at the end, or nothing can be done any more
        return status == Z_STREAM_END && stream_->avail_out == 0;
      }
    }
    return true;
  }

  struct End {
    void operator()(z_stream* stream) const { inflateEnd(stream); }
  };
  std::istream& file_;
  std::uint64_t left_;
  std::optional<z_stream> stream_;
  std::unique_ptr<z_stream, End> owner_;
  std::array<unsigned char, 4096> buffer_{};
};

class Walk {
 public:
  Walk(ElementBytes& bytes, bool big_endian) : bytes_(bytes), big_endian_(big_endian) {}

  // A tag's type and length, which must fit into `left`, and what it holds itself.
  struct Tag {
    std::uint32_t type = 0;
    std::uint64_t bytes = 0;
    std::uint64_t padded_bytes = 0;  // still to come in the file
    std::uint32_t value = 0;         // the first word of those in the tag
  };

  std::optional<Tag> ReadTag(std::uint64_t& left) {
    std::uint32_t first = 0;
    std::uint32_t second = 0;
    if (!ReadWord(left, first) || !ReadWord(left, second)) {
      return std::nullopt;
    }
    if (first >> 16 != 0) {  // up to four bytes, in the tag itself
      const Tag small{first & 0xffff, first >> 16, 0, second};
      return small.bytes <= 4 ? std::optional(small) : std::nullopt;
    }
    const std::uint64_t padded =
        std::min((std::uint64_t{second} + 7) / 8 * 8, left);  // the last needn't be
    return second <= left ? std::optional(Tag{first, second, padded, 0}) : std::nullopt;
  }

  // The inside of a matrix of `left` bytes; false if it doesn't fit.
  bool Matrix(std::uint64_t left, int depth) {  // NOLINT(misc-no-recursion)
    if (left == 0) {
      return true;
    }
    const std::optional<Tag> flags = ReadTag(left);
    std::uint32_t word = 0;
    if (depth > kMostLevels || !flags || flags->type != kUint32 || flags->bytes != 8 ||
        flags->padded_bytes != 8 || !ReadWord(left, word) || !Skip(left, 4)) {
      return false;
    }
    const std::uint32_t array_class = word & 0xff;
    if (array_class == kOpaque) {
      return Skip(left, left);
    }
    const std::optional<std::uint64_t> count = ReadCount(left);
    if (!count || !SkipText(left)) {
      return false;
    }
    switch (array_class) {
      case kCell:
      case kFunction:
        return Nested(left, *count, depth);
      case kStruct:
      case kObject: {
        if (array_class == kObject && !SkipText(left)) {
          return false;
        }
        const std::optional<std::uint64_t> fields = ReadFields(left);
        return fields && (*fields == 0 || *count <= left / *fields) &&
               Nested(left, *count * *fields, depth);
      }
      case kSparse:
        return Parts(left, depth);
      default:  // each number and letter takes a byte at least
        return *count <= left && Parts(left, depth);
    }
  }

 private:
  bool Skip(std::uint64_t& left, std::uint64_t count) {
    if (count > left || !bytes_.Skip(count)) {
      return false;
    }
    left -= count;
    return true;
  }

  bool ReadWord(std::uint64_t& left, std::uint32_t& word) {
    std::array<unsigned char, 4> raw{};
    if (left < raw.size() || !bytes_.Read(raw)) {
      return false;
    }
    left -= raw.size();
    word = 0;
    for (std::size_t k = 0; k < raw.size(); ++k) {
      word |= std::uint32_t{raw[k]} << (8 * (big_endian_ ? 3 - k : k));
    }
    return true;
  }

  bool SkipText(std::uint64_t& left) {
    const std::optional<Tag> text = ReadTag(left);
    return text && (text->type == kInt8 || text->type == kUint8) &&
           Skip(left, text->padded_bytes);
  }

  // The product of the extents; what a word can't hold is more than any file of this
  // version has.
  std::optional<std::uint64_t> ReadCount(std::uint64_t& left) {
    const std::optional<Tag> extents = ReadTag(left);
    if (!extents || extents->type != kInt32 || extents->bytes % 4 != 0 ||
        extents->padded_bytes == 0 || extents->bytes / 4 > kMostAxes) {
      return std::nullopt;
    }
    std::uint64_t count = 1;
    bool empty = false;
    bool too_many = false;
    for (std::uint64_t n = 0; n < extents->bytes / 4; ++n) {
      std::uint32_t extent = 0;
      if (!ReadWord(left, extent)) {
        return std::nullopt;
      }
      empty = empty || extent == 0;
      count *= extent;
      too_many = too_many || count > UINT32_MAX;
      count = too_many ? 1 : count;
    }
    if (!Skip(left, extents->padded_bytes - extents->bytes)) {
      return std::nullopt;
    }
    return empty ? 0 : too_many ? UINT64_MAX : count;
  }

  std::optional<std::uint64_t> ReadFields(std::uint64_t& left) {
    const std::optional<Tag> length = ReadTag(left);
    if (!length || length->type != kInt32 || length->bytes != 4 ||
        length->padded_bytes != 0 || length->value == 0) {
      return std::nullopt;
    }
    const std::optional<Tag> names = ReadTag(left);
    if (!names || names->type != kInt8 || !Skip(left, names->padded_bytes)) {
      return std::nullopt;
    }
    return names->bytes / length->value;
  }

  // What follows a name: parts that fill the rest.
  bool Parts(std::uint64_t& left, int depth) {
    while (left > 0) {
      const std::optional<Tag> part = ReadTag(left);
      if (!part) {
        return false;
      }
      if (depth == 0 && part->padded_bytes == left) {
        return true;  // the scan itself: whether it is whole is seen when it is read
      }
      if (!Skip(left, part->padded_bytes)) {
        return false;
      }
    }
    return true;
  }

  bool Nested(  // NOLINT(misc-no-recursion)
      std::uint64_t& left,
      std::uint64_t count,
      int depth) {
    if (count > left / kTagBytes || count > kMostNested - nested_) {
      return false;
    }
    nested_ += count;
    for (std::uint64_t n = 0; n < count; ++n) {
      const std::optional<Tag> inner = ReadTag(left);
      if (!inner || inner->type != kMatrix || inner->bytes > left ||
          !Matrix(inner->bytes, depth + 1)) {
        return false;
      }
      left -= inner->bytes;
    }
    return true;
  }

  ElementBytes& bytes_;
  bool big_endian_;
  std::uint64_t nested_ = 0;
};

}  // namespace

void CheckMatElements(std::istream& file, bool big_endian, const std::string& origin) {
  file.seekg(0, std::ios::end);
  const auto size = static_cast<std::uint64_t>(file.tellg());
  std::uint64_t at = 128;
  bool fits = size > at;
  while (fits && at < size) {
    file.clear();
    file.seekg(static_cast<std::streamoff>(at));
    std::uint64_t left = size - at;
    ElementBytes plain(file, left, false);
    const std::optional<Walk::Tag> tag = Walk(plain, big_endian).ReadTag(left);
    if (!tag) {
      fits = false;
      break;
    }
    if (tag->type == kMatrix) {
      fits = Walk(plain, big_endian).Matrix(tag->bytes, 0);
    } else if (tag->type == kCompressed) {
      ElementBytes unpacked(file, tag->bytes, true);
      std::uint64_t inside = tag->bytes * kMostPacking;
      const std::optional<Walk::Tag> matrix =
          Walk(unpacked, big_endian).ReadTag(inside);
      fits = matrix && matrix->type == kMatrix &&
             Walk(unpacked, big_endian).Matrix(matrix->bytes, 0);
    }
    at += kTagBytes + tag->bytes;
  }
  if (!fits) {
    throw BadData(fmt::format(
        "{}: truncated or damaged: at byte {} of {}, the lengths in it don't add up",
        origin,
        std::min(at, size),
        size));
  }
}

}  // namespace nacre::reconstruct
