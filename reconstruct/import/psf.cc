#include "reconstruct/import/psf.h"

#include "core/error.h"
#include "core/little_endian.h"
#include "core/options_json.h"
#include "core/provenance.h"
#include "reconstruct/internal/psf_layout.h"
#include "reconstruct/rd_dataset.h"

#include <array>
#include <bit>
#include <cmath>
#include <fmt/format.h>
#include <fstream>

namespace nacre::reconstruct {
namespace {

using internal::PsfLayout;

PsfLayout ReadLayout(std::ifstream& file,
                     std::uintmax_t bytes,
                     const std::string& origin) {
  std::array<unsigned char, PsfLayout::kHeaderBytes> head{};
  if (bytes < head.size() ||
      !file.read(static_cast<char*>(static_cast<void*>(head.data())), head.size())) {
    throw BadData(fmt::format(
        "{}: not a psf file: {} bytes, shorter than its header of 16", origin, bytes));
  }
  std::array<std::int32_t, 4> sizes{};
  constexpr std::array<const char*, 4> kNames = {"W", "H", "kw", "kh"};
  for (std::size_t n = 0; n < sizes.size(); ++n) {
    sizes[n] = std::bit_cast<std::int32_t>(LoadLittle32(&head[4 * n]));
    if (sizes[n] < 1) {
      throw BadData(fmt::format("{}: not a psf file: {} is {}, expected 1 or more",
                                origin,
                                kNames[n],
                                sizes[n]));
    }
  }
  if (sizes[2] != sizes[3] || sizes[2] % 2 == 0) {
    throw BadData(fmt::format(
        "{}: not a psf file: the window is kw x kh = {} x {}, expected square and odd",
        origin,
        sizes[2],
        sizes[3]));
  }
  const PsfLayout layout{sizes[0], sizes[1], sizes[2]};
  if (layout.FileBytes() != static_cast<double>(bytes)) {
    throw BadData(fmt::format(
        "{}: {}: W x H = {} x {} and k = {} need {:.0f} bytes, found {}",
        origin,
        static_cast<double>(bytes) < layout.FileBytes() ? "truncated" : "too long",
        layout.width,
        layout.height,
        layout.k,
        layout.FileBytes(),
        bytes));
  }
  return layout;
}

// One record to a slice, checked.
class RecordReader {
 public:
  RecordReader(const PsfLayout& layout,
               const ImportOptions& options,
               std::string origin)
      : layout_(layout),
        options_(options),
        origin_(std::move(origin)),
        bytes_(static_cast<std::size_t>(layout.RecordBytes())) {}

  void Read(std::ifstream& file, int i, int j, RdSlice& slice) {
    file.seekg(layout_.RecordOffset(i, j));
    if (!file.read(static_cast<char*>(static_cast<void*>(bytes_.data())),
                   static_cast<std::streamsize>(bytes_.size()))) {
      throw SystemError("cannot read " + origin_);
    }
    std::size_t at = 0;
    for (int c = 0; c < PsfLayout::kChannels; ++c) {
      for (int v = 0; v < layout_.k; ++v) {
        for (int u = 0; u < layout_.k; ++u) {
          slice.rd[at++] = Checked(i, j, c, u, v);
        }
      }
    }
  }

  std::int64_t clamped_count() const { return clamped_count_; }

 private:
  float Checked(int i, int j, int c, int u, int v) {
    const std::size_t index = layout_.RecordIndex(c, u, v);
    const auto value = std::bit_cast<float>(LoadLittle32(&bytes_[4 * index])) *
                       static_cast<float>(options_.scale);
    if (std::isfinite(value) && !(value < 0)) {
      return value;
    }
    if (value < 0 && std::isfinite(value) && options_.clamp_negative) {
      ++clamped_count_;
      return 0;
    }
    throw BadData(fmt::format(
        "{}: value {} at pixel x = {}, y = {}, window kx = {}, ky = {}, channel {} "
        "(counted as in the file, byte {}); R_d is finite and not negative{}",
        origin_,
        value,
        i,
        layout_.height - 1 - j,
        u,
        layout_.k - 1 - v,
        "RGB"[c],
        layout_.RecordOffset(i, j) + 4 * static_cast<std::int64_t>(index),
        std::isfinite(value) ? "; --clamp-negative reads it as 0" : ""));
  }

  PsfLayout layout_;
  ImportOptions options_;
  std::string origin_;
  std::vector<unsigned char> bytes_;
  std::int64_t clamped_count_ = 0;
};

}  // namespace

ImportSummary ImportPsf(const std::filesystem::path& from,
                        const std::filesystem::path& to,
                        const ImportOptions& options,
                        const ProgressFunction& progress) {
  nacre::Validate(options);
  std::ifstream file(from, std::ios::binary);
  if (!file || !std::filesystem::is_regular_file(from)) {
    throw Error("cannot read " + from.string() + ": there is no such file");
  }
  const PsfLayout layout =
      ReadLayout(file, std::filesystem::file_size(from), from.string());

  RdHeader header;
  header.points_x = layout.width;
  header.points_y = layout.height;
  header.core = layout.k;
  header.pitch_mm = options.pitch_mm;
  header.eta = options.eta;
  header.channels = {"R", "G", "B"};
  Validate(header, from.string());
  Provenance provenance{.command = "import", .options = OptionsToJson(options)};
  provenance.options["from"] = "psf";
  provenance.AddInput(from);
  header.provenance = provenance.ToString();

  RdWriter writer(to, header);
  RecordReader records(layout, options, from.string());
  RdSlice slice = MakeSlice(header);
  for (int j = 0; j < header.points_y; ++j) {
    Report(progress, {"import", j, header.points_y, ""});
    for (int i = 0; i < header.points_x; ++i) {
      records.Read(file, i, j, slice);
      writer.WriteSlice(i, j, slice);
    }
  }
  writer.Finish();
  Report(progress, {"import", header.points_y, header.points_y, ""});
  return {.points_x = header.points_x,
          .points_y = header.points_y,
          .core = header.core,
          .channel_count = PsfLayout::kChannels,
          .clamped_count = records.clamped_count()};
}

std::string ImportSummary::Brief() const {
  return fmt::format(
      "{} x {} points, core {}, {} channels; {} negative values clamped, {} cells "
      "invalid",
      points_x,
      points_y,
      core,
      channel_count,
      clamped_count,
      invalid_count);
}

}  // namespace nacre::reconstruct
