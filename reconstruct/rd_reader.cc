#include "core/error.h"
#include "core/exr_guard.h"
#include "reconstruct/internal/rd_format.h"
#include "reconstruct/internal/tile_reader.h"
#include "reconstruct/rd_dataset.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfInputPart.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfTileDescription.h>

#include <algorithm>
#include <bit>
#include <fmt/format.h>
#include <optional>
#include <span>

namespace nacre::reconstruct {
namespace {

using internal::kChecksum;
using internal::kPartCount;
using internal::kPartNames;
using internal::SliceName;

// deflate can't pack better than this; a header that declares more than it could ever
// unpack to is a lie, found before memory is taken for it.
constexpr double kMaxPacking = 1032;

// Runs OpenEXR calls; what it throws becomes BadData about `origin`.
template <class Call>
auto Checked(const std::string& origin, const std::string& doing, Call&& call) {
  try {
    return call();
  } catch (const Error&) {
    throw;
  } catch (const std::exception& e) {
    throw BadData(fmt::format("{}: {}: {}", origin, doing, e.what()));
  }
}

// Both go through all values without a branch, which compilers make vectors of.

bool AllFinite(std::span<const float> values) {
  constexpr std::uint32_t kExponent = 0x7F800000;
  std::uint32_t bad = 0;
  for (const float value : values) {
    bad |= (std::bit_cast<std::uint32_t>(value) & kExponent) == kExponent ? 1U : 0U;
  }
  return bad == 0;
}

// Whether all halves are 0 or 1, which become so many flags.
bool ToFlags(std::span<const std::uint16_t> halves, std::vector<std::uint8_t>& flags) {
  std::uint16_t bad = 0;
  for (const std::uint16_t half : halves) {
    bad |= half == 0 || half == internal::kHalfOne ? 0 : 1;
  }
  flags.resize(halves.size());
  std::ranges::transform(halves, flags.begin(), [](std::uint16_t half) {
    return static_cast<std::uint8_t>(half == internal::kHalfOne);
  });
  return bad == 0;
}

void CheckPart(const Imf::Header& part,
               const Imf::Header& expected,
               const std::string& origin) {
  const auto require = [&](bool good, const char* what) {
    if (!good) {
      throw BadData(
          fmt::format("{}: part '{}' has the wrong {}", origin, expected.name(), what));
    }
  };
  require(part.hasType() && part.type() == expected.type(), "type");
  require(part.dataWindow() == expected.dataWindow(),
          "data window for its attributes nacre.points and nacre.core");
  require(part.channels() == expected.channels(),
          "channels for its attribute nacre.channels");
  if (expected.hasTileDescription()) {
    require(part.hasTileDescription() &&
                part.tileDescription() == expected.tileDescription(),
            "tile size for its attribute nacre.core");
  }
}

void CheckSizes(const RdHeader& header,
                std::uintmax_t bytes,
                const std::string& origin) {
  const auto values = static_cast<double>(header.PointCount()) *
                      static_cast<double>(header.SliceSize());
  const double unpacked = values * 10 + 8.0 * static_cast<double>(header.PointCount());
  if (unpacked > kMaxPacking * static_cast<double>(bytes)) {
    throw BadData(fmt::format(
        "{}: points ({} x {}), core ({}) and channels ({}) declare {:.0f} bytes, "
        "more than a file of {} bytes can hold",
        origin,
        header.points_x,
        header.points_y,
        header.core,
        header.channels.size(),
        unpacked,
        bytes));
  }
}

}  // namespace

struct RdReader::File {
  explicit File(const std::filesystem::path& path)
      : origin(path.string()),
        input(path.c_str(), 0, /*reconstructChunkOffsetTable=*/false) {
    header = ReadHeader(std::filesystem::file_size(path));
    checksum.emplace(header);
    tile.emplace(header);
    ReadChecksums();
    for (int p = 0; p < kChecksum; ++p) {
      tiles[static_cast<std::size_t>(p)].emplace(
          input, *tile, static_cast<internal::Part>(p));
    }
  }

  RdHeader ReadHeader(std::uintmax_t bytes) {
    RdHeader found = internal::HeaderFromAttributes(input.header(0), origin);
    CheckSizes(found, bytes, origin);
    if (input.parts() != kPartCount) {
      throw BadData(fmt::format(
          "{}: has {} parts, expected {}", origin, input.parts(), int{kPartCount}));
    }
    const std::vector<Imf::Header> expected = internal::PartHeaders(found);
    for (int p = 0; p < kPartCount; ++p) {
      const auto name = kPartNames[static_cast<std::size_t>(p)];
      if (!input.header(p).hasName() || input.header(p).name() != name) {
        throw BadData(fmt::format("{}: part {} isn't '{}'", origin, p, name));
      }
      CheckPart(input.header(p), expected[static_cast<std::size_t>(p)], origin);
      if (!input.partComplete(p)) {
        throw BadData(
            fmt::format("{}: part '{}' is truncated or was never finished: make the "
                        "file again",
                        origin,
                        name));
      }
    }
    return found;
  }

  void ReadChecksums() {
    const auto count = static_cast<std::size_t>(header.PointCount());
    std::vector<std::uint32_t> low(count);
    std::vector<std::uint32_t> high(count);
    Imf::FrameBuffer buffer;
    const auto add = [&](const char* name, std::vector<std::uint32_t>& values) {
      buffer.insert(name,
                    Imf::Slice(Imf::UINT,
                               static_cast<char*>(static_cast<void*>(values.data())),
                               sizeof(std::uint32_t),
                               sizeof(std::uint32_t) *
                                   static_cast<std::size_t>(header.points_x)));
    };
    add("low", low);
    add("high", high);
    Imf::InputPart part(input, kChecksum);
    part.setFrameBuffer(buffer);
    part.readPixels(0, header.points_y - 1);
    checksums.resize(count);
    for (std::size_t s = 0; s < count; ++s) {
      checksums[s] = (std::uint64_t{high[s]} << 32) | low[s];
    }
  }

  std::string origin;
  RdHeader header;
  std::optional<internal::Checksum> checksum;
  std::vector<std::uint64_t> checksums;
  std::optional<internal::TileBuffer> tile;
  // The parts refer to the file: they are declared after and destroyed before it.
  Imf::MultiPartInputFile input;
  std::array<std::optional<internal::TileReader>, kChecksum> tiles;
};

RdReader::RdReader(const std::filesystem::path& path) {
  if (!std::filesystem::is_regular_file(path)) {
    throw Error("cannot read " + path.string() + ": there is no such file");
  }
  CheckExrSizes(path);
  Checked(path.string(), "not a readable dataset of R_d", [&] {
    file_ = std::make_unique<File>(path);
  });
}

RdReader::~RdReader() = default;
RdReader::RdReader(RdReader&&) noexcept = default;

const RdHeader& RdReader::header() const {
  return file_->header;
}

RdSlice RdReader::ReadSlice(int i, int j) {
  File& file = *file_;
  const RdHeader& header = file.header;
  Expect(i >= 0 && i < header.points_x && j >= 0 && j < header.points_y,
         "a slice on the grid");
  const std::int64_t s = std::int64_t{j} * header.points_x + i;
  const std::string name = SliceName(header, s);
  Checked(file.origin, "cannot read " + name, [&] {
    for (auto& part : file.tiles) {
      part->Read(i, j);
    }
  });
  RdSlice slice{file.tile->rd, file.tile->sigma, {}};
  if (!AllFinite(slice.rd) || !AllFinite(slice.sigma)) {
    throw BadData(fmt::format("{}: {} holds a NaN or an infinity", file.origin, name));
  }
  if (!ToFlags(file.tile->valid, slice.valid)) {
    throw BadData(
        fmt::format("{}: {} has a validity other than 0 and 1", file.origin, name));
  }
  if (file.checksum->Of(s, slice) != file.checksums[static_cast<std::size_t>(s)]) {
    throw BadData(fmt::format(
        "{}: {} doesn't match its checksum: the file is corrupt; get it or make it "
        "again",
        file.origin,
        name));
  }
  return slice;
}

}  // namespace nacre::reconstruct
