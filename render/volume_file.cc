#include "render/volume_file.h"

#include "core/atomic_file.h"
#include "core/error.h"

#include <bit>
#include <cmath>
#include <cstring>
#include <fmt/format.h>

namespace nacre::render {
namespace {

static_assert(std::endian::native == std::endian::little);

constexpr std::size_t kVolumeHeaderBytes = 48;
constexpr std::uint64_t kMaxBytes = std::uint64_t{4} << 30;

template <class T>
T At(const std::string& bytes, std::size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

}  // namespace

VolumeGrid ReadVolumeFile(const std::filesystem::path& path) {
  const std::string bytes = ReadFile(path, kMaxBytes);
  const auto fail = [&](const std::string& what) {
    return BadData(fmt::format("{}: {}", path.string(), what));
  };
  if (bytes.size() < kVolumeHeaderBytes || bytes.compare(0, 3, "VOL") != 0 ||
      bytes[3] != 3) {
    throw fail("not a volume (\"VOL\", version 3)");
  }
  if (const auto encoding = At<std::int32_t>(bytes, 4); encoding != 1) {
    throw fail(fmt::format("encoding {}; only 1, float32, is read", encoding));
  }
  VolumeGrid grid;
  double count = 1;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    grid.nodes[axis] = At<std::int32_t>(bytes, 8 + 4 * axis);
    if (grid.nodes[axis] < 1) {
      throw fail(fmt::format("{} nodes along an axis", grid.nodes[axis]));
    }
    count *= grid.nodes[axis];
  }
  grid.channels = At<std::int32_t>(bytes, 20);
  if (grid.channels != 1 && grid.channels != 3) {
    throw fail(fmt::format("{} channels; 1 or 3 are read", grid.channels));
  }
  count *= grid.channels;
  if (count * sizeof(float) != static_cast<double>(bytes.size() - kVolumeHeaderBytes)) {
    throw fail(fmt::format("{} values announced, {} bytes follow the header",
                           count,
                           bytes.size() - kVolumeHeaderBytes));
  }
  grid.low = At<Vec3>(bytes, 24);
  grid.high = At<Vec3>(bytes, 36);
  for (int axis = 0; axis < 3; ++axis) {
    if (!std::isfinite(grid.low[axis]) || !std::isfinite(grid.high[axis]) ||
        !(grid.low[axis] < grid.high[axis])) {
      throw fail("its box is empty or not finite");
    }
  }
  grid.values.resize(static_cast<std::size_t>(count));
  std::memcpy(grid.values.data(),
              bytes.data() + kVolumeHeaderBytes,
              bytes.size() - kVolumeHeaderBytes);
  for (const float v : grid.values) {
    if (!(v >= 0) || std::isinf(v)) {
      throw fail(fmt::format("a value of {}; they must be finite and not negative", v));
    }
  }
  return grid;
}

}  // namespace nacre::render
