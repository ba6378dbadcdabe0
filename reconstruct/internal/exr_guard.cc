#include "reconstruct/internal/exr_guard.h"

#include "core/error.h"
#include "core/little_endian.h"

#include <array>
#include <bit>
#include <fmt/format.h>
#include <fstream>
#include <string>

namespace nacre::reconstruct::internal {
namespace {

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
    const bool multipart = (Word() & kMultipartFlag) != 0;
    while (Header() && multipart) {
    }
  }

 private:
  static constexpr std::uint32_t kMagic = 20000630;
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
      std::int32_t rest = size;
      if (name == "chunkCount" && size == 4) {
        rest = 0;
        const auto chunks = std::bit_cast<std::int32_t>(Word());
        if (chunks < 0 || chunks > bytes_ / kChunkBytes) {
          throw BadData(fmt::format(
              "{}: chunkCount is {}, in a file of {} bytes", origin_, chunks, bytes_));
        }
      }
      file_.ignore(rest);
      position_ += rest;
      ++count;
    }
    return count > 0;
  }

  static constexpr std::int64_t kChunkBytes = 8;  // its entry in the table of offsets

  std::uint32_t Word() {
    std::array<unsigned char, 4> bytes{};
    file_.read(static_cast<char*>(static_cast<void*>(bytes.data())), bytes.size());
    position_ += 4;
    Require();
    return LoadLittle32(bytes.data());
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
  std::int64_t position_ = 0;
};

}  // namespace

void CheckExrSizes(const std::filesystem::path& path) {
  HeaderWalk(path).Run();
}

}  // namespace nacre::reconstruct::internal
