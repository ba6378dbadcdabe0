#include "reconstruct/internal/tile_reader.h"

#include <OpenEXR/ImfChannelList.h>

#include <algorithm>
#include <bit>
#include <fmt/format.h>
#include <stdexcept>

namespace nacre::reconstruct::internal {

TileReader::TileReader(Imf::MultiPartInputFile& input, TileBuffer& buffer, Part part)
    : part_(input, part),
      line_bytes_(TileBuffer::ValueBytes(part) * static_cast<std::size_t>(buffer.core)),
      tile_bytes_(line_bytes_ * static_cast<std::size_t>(buffer.core) *
                  buffer.channels.size()) {
  const Imf::FrameBuffer planes = buffer.FrameBuffer(part);
  part_.setFrameBuffer(planes);
  const Imf::ChannelList& channels = part_.header().channels();
  for (auto channel = channels.begin(); channel != channels.end(); ++channel) {
    planes_.push_back(planes[channel.name()].base);
  }
}

void TileReader::Read(int i, int j) {
  int tile_x = i;
  int tile_y = j;
  int level_x = 0;
  int level_y = 0;
  const char* bytes = nullptr;
  int count = 0;
  part_.rawTileData(tile_x, tile_y, level_x, level_y, bytes, count);
  if (count < 0) {  // OpenEXR lets such a size of a damaged file through
    throw std::runtime_error(fmt::format("its tile has {} bytes", count));
  }
  const std::span<const char> stored(bytes, static_cast<std::size_t>(count));
  // OpenEXR, too, takes so many bytes for numbers, whatever the compression. They are
  // little endian.
  if (stored.size() == tile_bytes_ && std::endian::native == std::endian::little) {
    packed_.clear();
    CopyLines(stored);
    return;
  }
  if (std::ranges::equal(stored, packed_)) {
    return;
  }
  packed_.clear();  // should this fail
  candidate_.assign(stored.begin(), stored.end());
  part_.readTile(i, j);
  packed_.swap(candidate_);
}

// A line of a tile holds that line of each channel.
void TileReader::CopyLines(std::span<const char> lines) {
  const std::size_t line_count = tile_bytes_ / (line_bytes_ * planes_.size());
  for (std::size_t y = 0; y < line_count; ++y) {
    for (char* plane : planes_) {
      std::ranges::copy(lines.first(line_bytes_), plane + y * line_bytes_);
      lines = lines.subspan(line_bytes_);
    }
  }
}

}  // namespace nacre::reconstruct::internal
