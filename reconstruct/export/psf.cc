#include "reconstruct/export/psf.h"

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/little_endian.h"
#include "reconstruct/internal/psf_layout.h"
#include "reconstruct/rd_dataset.h"

#include <bit>
#include <fmt/format.h>
#include <fstream>

namespace nacre::reconstruct {
namespace {

using internal::PsfLayout;

// The record of one slice.
void Encode(const PsfLayout& layout,
            const RdSlice& slice,
            std::vector<unsigned char>& record) {
  std::size_t at = 0;
  for (int c = 0; c < PsfLayout::kChannels; ++c) {
    for (int v = 0; v < layout.k; ++v) {
      for (int u = 0; u < layout.k; ++u) {
        StoreLittle32(std::bit_cast<std::uint32_t>(slice.rd[at++]),
                      &record[4 * layout.RecordIndex(c, u, v)]);
      }
    }
  }
}

void Prepare(const ExportOptions& options,
             const std::string& name,
             RdSlice& slice,
             ExportSummary& summary) {
  for (std::size_t k = 0; k < slice.rd.size(); ++k) {
    summary.invalid_count += slice.valid[k] == 0 ? 1 : 0;
    if (slice.rd[k] < 0) {
      if (!options.clamp_negative) {
        throw BadData(fmt::format(
            "{} holds the negative value {}, which readers of psf files don't expect; "
            "--clamp-negative writes 0 instead",
            name,
            slice.rd[k]));
      }
      slice.rd[k] = 0;
      ++summary.clamped_count;
    }
  }
}

void Write(std::ofstream& file,
           const unsigned char* bytes,
           std::size_t count,
           const std::filesystem::path& path) {
  if (!file.write(static_cast<const char*>(static_cast<const void*>(bytes)),
                  static_cast<std::streamsize>(count))) {
    throw SystemError("cannot write " + path.string());
  }
}

}  // namespace

ExportSummary ExportPsf(const std::filesystem::path& from,
                        const std::filesystem::path& to,
                        const ExportOptions& options,
                        const ProgressFunction& progress) {
  RdReader reader(from);
  const RdHeader& header = reader.header();
  if (header.channels.size() != PsfLayout::kChannels) {
    throw UsageError(fmt::format(
        "cannot export {} to psf: it has {} channels, psf holds three (RGB)",
        from.string(),
        header.channels.size()));
  }
  const PsfLayout layout{header.points_x, header.points_y, header.core};
  AtomicFile atomic(to);
  std::ofstream file(atomic.temporary_path(), std::ios::binary);
  std::vector<unsigned char> record(PsfLayout::kHeaderBytes);
  StoreLittle32(static_cast<std::uint32_t>(layout.width), &record[0]);
  StoreLittle32(static_cast<std::uint32_t>(layout.height), &record[4]);
  StoreLittle32(static_cast<std::uint32_t>(layout.k), &record[8]);
  StoreLittle32(static_cast<std::uint32_t>(layout.k), &record[12]);
  Write(file, record.data(), record.size(), to);

  ExportSummary summary;
  summary.bytes = PsfLayout::kHeaderBytes + header.PointCount() * layout.RecordBytes();
  record.resize(static_cast<std::size_t>(layout.RecordBytes()));
  for (int j = header.points_y - 1; j >= 0; --j) {  // the file's lowest y first
    Report(progress, {"export", header.points_y - 1 - j, header.points_y, ""});
    for (int i = 0; i < header.points_x; ++i) {
      RdSlice slice = reader.ReadSlice(i, j);
      Prepare(options,
              fmt::format("{}: slice ({}, {})", from.string(), i, j),
              slice,
              summary);
      Encode(layout, slice, record);
      Write(file, record.data(), record.size(), to);
    }
  }
  file.close();
  if (!file) {
    throw SystemError("cannot write " + to.string());
  }
  atomic.Commit();
  Report(progress, {"export", header.points_y, header.points_y, ""});
  return summary;
}

std::string ExportSummary::Brief() const {
  return fmt::format("{} bytes; {} negative values clamped, {} values marked invalid",
                     bytes,
                     clamped_count,
                     invalid_count);
}

}  // namespace nacre::reconstruct
