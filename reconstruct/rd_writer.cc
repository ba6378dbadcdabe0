#include "core/atomic_file.h"
#include "core/error.h"
#include "reconstruct/internal/rd_format.h"
#include "reconstruct/internal/slice_spool.h"
#include "reconstruct/rd_dataset.h"

#include <OpenEXR/ImfMultiPartOutputFile.h>
#include <OpenEXR/ImfOutputPart.h>
#include <OpenEXR/ImfTiledOutputPart.h>

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <optional>

namespace nacre::reconstruct {

using internal::Checksum;
using internal::SliceName;
using internal::SliceSpool;
using internal::TileBuffer;

// Tiles lie in the file in the order they are written, so slices go to it in the order
// of their index, whatever order they come in: those that come early wait in a spool.
// That makes the bytes of the file a function of its contents alone.
struct RdWriter::File {
  File(const std::filesystem::path& file_path, const RdHeader& file_header)
      : path(file_path),
        header(file_header),
        atomic(file_path),
        spool(atomic.temporary_path().parent_path(), header),
        checksum(header),
        checksums(static_cast<std::size_t>(header.PointCount())),
        tile(header) {
    const std::vector<Imf::Header> parts = internal::PartHeaders(header);
    output.emplace(
        atomic.temporary_path().c_str(), parts.data(), static_cast<int>(parts.size()));
    for (int p = 0; p < internal::kChecksum; ++p) {
      tiles[static_cast<std::size_t>(p)].emplace(*output, p);
      tiles[static_cast<std::size_t>(p)]->setFrameBuffer(
          tile.FrameBuffer(static_cast<internal::Part>(p)));
    }
  }

  void Append(const RdSlice& slice) {
    const std::int64_t s = next++;
    checksums[static_cast<std::size_t>(s)] = checksum.Of(s, slice);
    tile.rd = slice.rd;  // same size: the frame buffer's addresses stay good
    tile.sigma = slice.sigma;
    std::transform(
        slice.valid.begin(), slice.valid.end(), tile.valid.begin(), [](auto v) {
          return v != 0 ? internal::kHalfOne : std::uint16_t{0};
        });
    for (auto& part : tiles) {
      part->writeTile(static_cast<int>(s % header.points_x),
                      static_cast<int>(s / header.points_x));
    }
  }

  void WriteChecksums() {
    std::vector<std::uint32_t> low(checksums.size());
    std::vector<std::uint32_t> high(checksums.size());
    for (std::size_t s = 0; s < checksums.size(); ++s) {
      low[s] = static_cast<std::uint32_t>(checksums[s]);
      high[s] = static_cast<std::uint32_t>(checksums[s] >> 32);
    }
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
    Imf::OutputPart part(*output, internal::kChecksum);
    part.setFrameBuffer(buffer);
    part.writePixels(header.points_y);
  }

  std::filesystem::path path;
  RdHeader header;
  AtomicFile atomic;
  SliceSpool spool;
  Checksum checksum;
  std::vector<std::uint64_t> checksums;
  TileBuffer tile;
  std::int64_t next = 0;  ///< index of the next slice of the file
  // The parts refer to the file: they are declared after and destroyed before it.
  std::optional<Imf::MultiPartOutputFile> output;
  std::array<std::optional<Imf::TiledOutputPart>, internal::kChecksum> tiles;
};

RdWriter::RdWriter(const std::filesystem::path& path, const RdHeader& header) {
  Validate(header, path.string());
  try {
    file_ = std::make_unique<File>(path, header);
  } catch (const Error&) {
    throw;
  } catch (const std::exception& e) {
    throw Error("cannot write " + path.string() + ": " + e.what());
  }
}

RdWriter::~RdWriter() = default;

void RdWriter::WriteSlice(int i, int j, const RdSlice& slice) {
  File& file = *file_;
  const RdHeader& header = file.header;
  Expect(file.output.has_value(), "a writer that wasn't finished");
  Expect(i >= 0 && i < header.points_x && j >= 0 && j < header.points_y,
         "a slice on the grid");
  const auto size = static_cast<std::size_t>(header.SliceSize());
  Expect(slice.rd.size() == size && slice.sigma.size() == size &&
             slice.valid.size() == size,
         "a slice of channels * core * core values");
  const std::int64_t s = std::int64_t{j} * header.points_x + i;
  const auto finite = [](float value) { return std::isfinite(value); };
  if (!std::all_of(slice.rd.begin(), slice.rd.end(), finite) ||
      !std::all_of(slice.sigma.begin(), slice.sigma.end(), finite)) {
    throw BadData(fmt::format("cannot write {}: {} holds a NaN or an infinity",
                              file.path.string(),
                              SliceName(header, s)));
  }
  Expect(s >= file.next && !file.spool.Holds(s), "each slice once");
  try {
    if (s != file.next) {
      file.spool.Park(s, slice);
      return;
    }
    file.Append(slice);
    while (file.next < header.PointCount() && file.spool.Holds(file.next)) {
      file.Append(file.spool.Fetch(file.next));
    }
  } catch (const Error&) {
    throw;
  } catch (const std::exception& e) {
    throw Error("cannot write " + file.path.string() + ": " + e.what());
  }
}

void RdWriter::Finish() {
  File& file = *file_;
  Expect(file.output.has_value(), "a writer that wasn't finished");
  Expect(file.next == file.header.PointCount(), "every slice was written");
  try {
    file.WriteChecksums();
    for (auto& part : file.tiles) {
      part.reset();
    }
    file.output.reset();
  } catch (const std::exception& e) {
    throw Error("cannot write " + file.path.string() + ": " + e.what());
  }
  // OpenEXR writes its tables when it closes the file, and can't report a failure then.
  const RdReader written(file.atomic.temporary_path());
  file.atomic.Commit();
}

}  // namespace nacre::reconstruct
