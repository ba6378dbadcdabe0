#include "core/exr_guard.h"

#include "core/error.h"
#include "core/little_endian.h"

#include <array>
#include <bit>
#include <fmt/format.h>
#include <fstream>
#include <map>
#include <string>
#include <string_view>

namespace nacre {
namespace {

// Bytes of a value by the name of its type, where all values of it have as many.
const std::map<std::string_view, std::int32_t> kSizes{
    {"box2i", 16},      {"box2f", 16},   {"chromaticities", 32},
    {"compression", 1}, {"double", 8},   {"envmap", 1},
    {"float", 4},       {"int", 4},      {"keycode", 28},
    {"lineOrder", 1},   {"m33f", 36},    {"m33d", 72},
    {"m44f", 64},       {"m44d", 128},   {"rational", 8},
    {"tiledesc", 9},    {"timecode", 8}, {"v2i", 8},
    {"v2f", 8},         {"v2d", 16},     {"v3i", 12},
    {"v3f", 12},        {"v3d", 24},     {"deepImageState", 1}};

std::uint32_t WordAt(std::string_view bytes, std::size_t at) {
  std::array<unsigned char, 4> word{};
  for (std::size_t k = 0; k < word.size(); ++k) {
    word[k] = static_cast<unsigned char>(bytes[at + k]);
  }
  return LoadLittle32(word.data());
}

// Names, each with 16 bytes that describe the channel, and an empty name at the end.
bool IsChannelList(std::string_view bytes) {
  constexpr std::size_t kDescription = 16;
  while (!bytes.empty()) {
    const std::size_t end = bytes.find('\0');
    if (end == 0 || end == std::string_view::npos) {
      return end == 0 && bytes.size() == 1;
    }
    if (bytes.size() < end + 1 + kDescription) {
      return false;
    }
    bytes.remove_prefix(end + 1 + kDescription);
  }
  return false;
}

// Texts, each after its length.
bool IsStringVector(std::string_view bytes) {
  while (!bytes.empty()) {
    if (bytes.size() < 4 || WordAt(bytes, 0) > bytes.size() - 4) {
      return false;
    }
    bytes.remove_prefix(4 + WordAt(bytes, 0));
  }
  return true;
}

// Width, height, and four bytes a pixel.
bool IsPreview(std::string_view bytes) {
  return bytes.size() >= 8 && static_cast<double>(bytes.size() - 8) ==
                                  4.0 * WordAt(bytes, 0) * WordAt(bytes, 4);
}

bool HasSizeOfItsType(std::string_view type, std::string_view value) {
  const auto fixed = kSizes.find(type);
  if (fixed != kSizes.end()) {
    return static_cast<std::int64_t>(value.size()) == fixed->second;
  }
  return type == "chlist"         ? IsChannelList(value)
         : type == "stringvector" ? IsStringVector(value)
         : type == "preview"      ? IsPreview(value)
                                  : true;
}

// OpenEXR file layout, version 2: magic, version and flags, then header after header,
// each a list of attributes (name, type, size, value) ended by an empty name; a file of
// several parts ends its headers with an empty one.
class HeaderWalk {
 public:
  explicit HeaderWalk(const std::filesystem::path& path)
      : origin_(path.string()),
        file_(path, std::ios::binary),
        bytes_(static_cast<std::int64_t>(std::filesystem::file_size(path))) {}

  void Run() {
    if (Word() != kMagic) {
      throw BadData(origin_ + ": not an OpenEXR file");
    }
    const std::uint32_t flags = Word();
    counts_chunks_ = (flags & (kMultipartFlag | kTiledFlag)) != 0;
    while (Header() && (flags & kMultipartFlag) != 0) {
    }
  }

 private:
  static constexpr std::uint32_t kMagic = 20000630;
  static constexpr std::uint32_t kTiledFlag = 0x200;
  static constexpr std::uint32_t kMultipartFlag = 0x1000;
  static constexpr std::size_t kMaxName = 255;

  // One header; false if it has no attributes.
  bool Header() {
    int count = 0;
    for (std::string name = Name(); !name.empty(); name = Name()) {
      const std::string type = Name();
      const auto size = std::bit_cast<std::int32_t>(Word());
      if (size < 0 || size > bytes_ - position_) {
        throw BadData(
            fmt::format("{}: attribute '{}' declares {} bytes, in a file of {} bytes",
                        origin_,
                        name,
                        size,
                        bytes_));
      }
      const std::string value = Value(size);
      if (!HasSizeOfItsType(type, value)) {
        throw BadData(fmt::format("{}: attribute '{}' of type '{}' can't have {} bytes",
                                  origin_,
                                  name,
                                  type,
                                  size));
      }
      CheckChunks(name, value);
      ++count;
    }
    return count > 0;
  }

  // The table of offsets, which OpenEXR makes room for, must fit into the file.
  void CheckChunks(const std::string& name, const std::string& value) {
    constexpr std::int64_t kEntryBytes = 8;
    constexpr std::int64_t kMostLines = 256;  // in a chunk of scan lines
    std::int64_t chunks = 0;
    if (name == "chunkCount" && value.size() == 4) {
      chunks = std::bit_cast<std::int32_t>(WordAt(value, 0));
    } else if (name == "dataWindow" && value.size() == 16 && !counts_chunks_) {
      const std::int64_t top = std::bit_cast<std::int32_t>(WordAt(value, 4));
      const std::int64_t bottom = std::bit_cast<std::int32_t>(WordAt(value, 12));
      chunks = (bottom - top + 1) / kMostLines;
    }
    if (chunks < 0 || chunks > bytes_ / kEntryBytes) {
      throw BadData(fmt::format("{}: {} asks for {} chunks, in a file of {} bytes",
                                origin_,
                                name,
                                chunks,
                                bytes_));
    }
  }

  std::uint32_t Word() { return WordAt(Value(4), 0); }

  std::string Value(std::int32_t size) {
    std::string value(static_cast<std::size_t>(size), '\0');
    file_.read(value.data(), size);
    position_ += size;
    Require();
    return value;
  }

  std::string Name() {
    std::string name;
    for (int c = file_.get(); c != 0; c = file_.get()) {
      Require();
      ++position_;
      name += static_cast<char>(c);
      if (name.size() > kMaxName) {
        throw BadData(origin_ + ": an attribute's name is longer than 255 bytes");
      }
    }
    ++position_;
    return name;
  }

  void Require() {
    if (!file_) {
      throw BadData(fmt::format(
          "{}: truncated: its {} bytes end within the header", origin_, bytes_));
    }
  }

  std::string origin_;
  std::ifstream file_;
  std::int64_t bytes_;
  bool counts_chunks_ = false;  // in an attribute; else lines say how many there are
  std::int64_t position_ = 0;
};

}  // namespace

void CheckExrSizes(const std::filesystem::path& path) {
  HeaderWalk(path).Run();
}

}  // namespace nacre
