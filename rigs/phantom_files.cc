#include "rigs/phantom_files.h"

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/exr.h"
#include "core/png.h"
#include "rigs/phantom_voxels.h"

#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fmt/format.h>
#include <optional>
#include <string_view>

namespace nacre::rigs {
namespace {

std::size_t SizeOf(RawType type) {
  switch (type) {
    case RawType::kUint8:
      return 1;
    case RawType::kUint16:
      return 2;
    case RawType::kFloat32:
      return 4;
  }
  throw LogicError("numbers of no type");
}

void CheckCount(const std::array<int, 3>& count, const std::string& origin) {
  std::size_t voxels = 1;
  for (const int along : count) {
    if (along < 1 || static_cast<std::size_t>(along) > kMostVoxels / voxels) {
      throw BadData(
          fmt::format("{}: {} × {} × {} voxels; each number must be at least 1 and "
                      "their product at most {}: use fewer and larger ones",
                      origin,
                      count[0],
                      count[1],
                      count[2],
                      kMostVoxels));
    }
    voxels *= static_cast<std::size_t>(along);
  }
}

std::uint32_t LittleEndian(const char* bytes, std::size_t size) {
  std::uint32_t word = 0;
  for (std::size_t k = 0; k < size; ++k) {
    word |= std::uint32_t{static_cast<unsigned char>(bytes[k])} << (8 * k);
  }
  return word;
}

VoxelNumbers Unpack(const std::string& bytes,
                    const RawLayout& layout,
                    const std::string& origin) {
  CheckCount(layout.count, origin);
  const std::size_t size = SizeOf(layout.type);
  const std::size_t count = VoxelLayout{.count = layout.count}.VoxelCount();
  if (bytes.size() < layout.skip_bytes ||
      bytes.size() - layout.skip_bytes != count * size) {
    throw BadData(fmt::format(
        "{}: holds {} bytes, but {} × {} × {} numbers of type {} after a header of {} "
        "bytes are {}; check sizes, type and header",
        origin,
        bytes.size(),
        layout.count[0],
        layout.count[1],
        layout.count[2],
        Name(layout.type),
        layout.skip_bytes,
        count * size + layout.skip_bytes));
  }
  VoxelNumbers numbers{.count = layout.count};
  numbers.full_scale = layout.type == RawType::kUint8    ? 255
                       : layout.type == RawType::kUint16 ? 65535
                                                         : 1;
  numbers.value.reserve(count);
  for (std::size_t k = 0; k < count; ++k) {
    const std::uint32_t word =
        LittleEndian(bytes.data() + layout.skip_bytes + k * size, size);
    const double value = layout.type == RawType::kFloat32
                             ? static_cast<double>(std::bit_cast<float>(word))
                             : static_cast<double>(word);
    if (!std::isfinite(value)) {
      throw BadData(
          fmt::format("{}: number {} is {}; all must be finite", origin, k, value));
    }
    numbers.value.push_back(value);
  }
  return numbers;
}

// Room for the largest volume there may be, and a header.
constexpr std::uint64_t kMostBytes = 4 * kMostVoxels + (1 << 20);

// The text of `'key': …` in the header's dictionary, up to its end.
std::string_view NpyEntry(std::string_view header,
                          std::string_view key,
                          const std::string& origin) {
  const std::size_t at = header.find(key);
  const std::size_t colon = at == header.npos ? at : header.find(':', at);
  if (colon == header.npos) {
    throw BadData(fmt::format("{}: its NumPy header has no {}", origin, key));
  }
  std::string_view entry = header.substr(colon + 1);
  entry.remove_prefix(std::min(entry.find_first_not_of(' '), entry.size()));
  return entry;
}

std::vector<int> NpyShape(std::string_view entry, const std::string& origin) {
  const std::size_t end = entry.find(')');
  const auto refuse = [&] {
    throw BadData(
        fmt::format("{}: its NumPy shape can't be read, '{}'; (z, y, x) is needed",
                    origin,
                    entry.substr(0, std::min<std::size_t>(entry.size(), 40))));
  };
  if (entry.empty() || entry.front() != '(' || end == entry.npos) {
    refuse();
  }
  std::vector<int> shape;
  std::string_view rest = entry.substr(1, end - 1);
  while (!rest.empty()) {
    const std::size_t start = rest.find_first_not_of(" ,");
    if (start == rest.npos) {
      break;
    }
    int value = 0;
    const auto [stop, error] =
        std::from_chars(rest.data() + start, rest.data() + rest.size(), value);
    if (error != std::errc{} || value < 1) {
      refuse();
    }
    shape.push_back(value);
    rest.remove_prefix(static_cast<std::size_t>(stop - rest.data()));
  }
  if (shape.size() != 2 && shape.size() != 3) {
    refuse();
  }
  return shape;
}

struct Slice {
  int width = 0;
  int height = 0;
  double full_scale = 1;
  std::vector<double> value;  // row by row from the top
};

Slice ReadPngSlice(const std::filesystem::path& path) {
  const PngImage image = ReadPng(path);
  if (image.channel_count != 1) {
    throw BadData(fmt::format("{}: has {} channels; save it as a grey picture",
                              path.string(),
                              image.channel_count));
  }
  Slice slice{image.width, image.height, image.bit_depth == 8 ? 255.0 : 65535.0, {}};
  slice.value.assign(image.values.begin(), image.values.end());
  return slice;
}

Slice ReadExrSlice(const std::filesystem::path& path, const std::string& channel) {
  const ExrPart part = ReadExr(path, std::size_t{1} << 30).front();
  if (channel.empty() && part.channels.size() != 1) {
    throw BadData(
        fmt::format("{}: has {} channels; say which is meant, channel = \"…\"",
                    path.string(),
                    part.channels.size()));
  }
  const int index = channel.empty() ? 0 : part.FindChannel(channel);
  if (index < 0) {
    throw BadData(fmt::format("{}: has no channel '{}'", path.string(), channel));
  }
  Slice slice{part.width, part.height, 1, {}};
  const float* const value = part.Channel(static_cast<std::size_t>(index));
  for (std::size_t k = 0; k < part.PixelCount(); ++k) {
    if (!std::isfinite(value[k])) {
      throw BadData(fmt::format(
          "{}: pixel {} is {}; all must be finite", path.string(), k, value[k]));
    }
    slice.value.push_back(static_cast<double>(value[k]));
  }
  return slice;
}

}  // namespace

const char* Name(RawType type) {
  switch (type) {
    case RawType::kUint8:
      return "uint8";
    case RawType::kUint16:
      return "uint16";
    case RawType::kFloat32:
      return "float32";
  }
  throw LogicError("numbers of no type");
}

VoxelNumbers ReadRawVoxels(const std::filesystem::path& path, const RawLayout& layout) {
  CheckCount(layout.count, path.string());
  return Unpack(ReadFile(path, kMostBytes), layout, path.string());
}

VoxelNumbers ReadNpyVoxels(const std::filesystem::path& path) {
  const std::string bytes = ReadFile(path, kMostBytes);
  const std::string origin = path.string();
  constexpr std::string_view kMagic = "\x93NUMPY";
  constexpr std::size_t kShortHead = 10;
  if (bytes.size() < kShortHead || !bytes.starts_with(kMagic)) {
    throw BadData(origin + ": isn't a NumPy file (.npy)");
  }
  const int version = static_cast<unsigned char>(bytes[6]);
  const std::size_t head = version == 1 ? kShortHead : 12;
  if (version < 1 || version > 3 || bytes.size() < head) {
    throw BadData(fmt::format(
        "{}: a NumPy file of version {}; 1 to 3 can be read", origin, version));
  }
  const std::size_t length = LittleEndian(bytes.data() + 8, head - 8);
  if (length > bytes.size() - head) {
    throw BadData(origin + ": ends in its NumPy header");
  }
  const std::string_view header = std::string_view(bytes).substr(head, length);
  std::optional<RawType> type;
  const std::string_view descr = NpyEntry(header, "'descr'", origin);
  for (const auto& [name, meant] : {std::pair{"'|u1'", RawType::kUint8},
                                    std::pair{"'<u2'", RawType::kUint16},
                                    std::pair{"'<f4'", RawType::kFloat32}}) {
    if (descr.starts_with(name)) {
      type = meant;
    }
  }
  if (!type || !NpyEntry(header, "'fortran_order'", origin).starts_with("False")) {
    throw BadData(fmt::format(
        "{}: NumPy array of type {}; needed is uint8, uint16 or float32 in C order: "
        "numpy.ascontiguousarray(a, dtype=numpy.uint8)",
        origin,
        descr.substr(0, std::min<std::size_t>(descr.find(','), 20))));
  }
  const std::vector<int> shape = NpyShape(NpyEntry(header, "'shape'", origin), origin);
  RawLayout layout{.count = {shape.back(), shape[shape.size() - 2], 1},
                   .type = *type,
                   .skip_bytes = head + length};
  if (shape.size() == 3) {
    layout.count[2] = shape[0];
  }
  return Unpack(bytes, layout, origin);
}

VoxelNumbers ReadPictures(const std::vector<std::filesystem::path>& paths,
                          const std::string& channel) {
  VoxelNumbers numbers;
  for (const std::filesystem::path& path : paths) {
    const Slice slice =
        path.extension() == ".png" ? ReadPngSlice(path) : ReadExrSlice(path, channel);
    const std::array<int, 3> count{
        slice.width, slice.height, static_cast<int>(paths.size())};
    if (numbers.value.empty()) {
      CheckCount(count, path.string());
      numbers.count = count;
      numbers.full_scale = slice.full_scale;
    }
    if (count != numbers.count || slice.full_scale != numbers.full_scale) {
      throw BadData(fmt::format(
          "{}: {} × {} pixels, full scale {}, but {} is {} × {}, {}; all slices must "
          "be alike",
          path.string(),
          slice.width,
          slice.height,
          slice.full_scale,
          paths.front().string(),
          numbers.count[0],
          numbers.count[1],
          numbers.full_scale));
    }
    const auto width = static_cast<std::size_t>(slice.width);
    for (std::size_t row = static_cast<std::size_t>(slice.height); row-- > 0;) {
      const auto begin = slice.value.begin() + static_cast<std::ptrdiff_t>(row * width);
      numbers.value.insert(
          numbers.value.end(), begin, begin + static_cast<std::ptrdiff_t>(width));
    }
  }
  return numbers;
}

}  // namespace nacre::rigs
