#include "reconstruct/import/array.h"

#include "core/error.h"
#include "core/options_json.h"
#include "core/provenance.h"
#include "reconstruct/rd_dataset.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <fmt/format.h>
#include <fmt/ranges.h>

namespace nacre::reconstruct {
namespace {

enum Axis { kY, kX, kV, kU, kC, kAxisCount };
constexpr std::string_view kLetters = "yxvuc";

// The array with its axes in the order y, x, v, u, c, all from the top.
struct Scan {
  const unsigned char* data;
  NumberType type;
  bool big_endian;
  std::array<std::int64_t, kAxisCount> extent;
  std::array<std::int64_t, kAxisCount> stride;
};

Scan Arrange(const ArrayView& array,
             const ArrayImportOptions& options,
             const std::string& origin) {
  const std::size_t rank = array.extent.size();
  const std::string axes = !options.axes.empty() ? options.axes
                           : rank == 4           ? std::string("yxvu")
                                                 : std::string(kLetters);
  if (axes.size() != rank) {
    throw UsageError(
        fmt::format("{}: its array has {} axes, {}; --axes names {} ('{}')",
                    origin,
                    rank,
                    array.extent,
                    axes.size(),
                    axes));
  }
  Scan scan{array.data, array.type, array.big_endian, {1, 1, 1, 1, 1}, {}};
  for (std::size_t n = 0; n < kLetters.size(); ++n) {
    const std::size_t at = axes.find(kLetters[n]);
    if (at == axes.npos && n != kC) {
      throw UsageError(fmt::format(
          "--axes '{}' has no {}; y, x, v and u are needed once each, c if there are "
          "channels",
          axes,
          kLetters[n]));
    }
    if (at != axes.npos) {
      scan.extent[n] = array.extent[at];
      scan.stride[n] = array.stride_bytes[at];
    }
  }
  if (axes.find_first_not_of(kLetters) != axes.npos ||
      std::any_of(kLetters.begin(), kLetters.end(), [&](char letter) {
        return std::count(axes.begin(), axes.end(), letter) > 1;
      })) {
    throw UsageError(
        fmt::format("--axes '{}': letters are y, x, v, u and c, once each", axes));
  }
  if (options.bottom_first) {
    for (const Axis axis : {kY, kV}) {
      scan.data += (scan.extent[axis] - 1) * scan.stride[axis];
      scan.stride[axis] = -scan.stride[axis];
    }
  }
  return scan;
}

std::vector<std::string> ChannelNames(const std::string& list,
                                      std::int64_t count,
                                      const std::string& origin) {
  std::vector<std::string> names;
  if (list.empty()) {
    for (std::int64_t c = 0; c < count; ++c) {
      names.push_back(count == 3 ? std::string(1, "RGB"[c]) : fmt::format("{}", c));
    }
    return names;
  }
  for (std::size_t at = 0; at <= list.size();) {
    const std::size_t end = std::min(list.find(',', at), list.size());
    names.push_back(list.substr(at, end - at));
    at = end + 1;
  }
  if (std::ssize(names) != count) {
    throw UsageError(fmt::format("{}: {} channels, --channels names {}: '{}'",
                                 origin,
                                 count,
                                 names.size(),
                                 list));
  }
  return names;
}

template <class Number>
double Load(const unsigned char* bytes, bool big_endian) {
  std::array<unsigned char, sizeof(Number)> copy{};
  std::memcpy(copy.data(), bytes, copy.size());
  if (big_endian != (std::endian::native == std::endian::big)) {
    std::reverse(copy.begin(), copy.end());
  }
  return static_cast<double>(std::bit_cast<Number>(copy));
}

double LoadNumber(const Scan& scan, const unsigned char* bytes) {
  switch (scan.type) {
    case NumberType::kUint8:
      return static_cast<double>(*bytes);
    case NumberType::kUint16:
      return Load<std::uint16_t>(bytes, scan.big_endian);
    case NumberType::kFloat32:
      return Load<float>(bytes, scan.big_endian);
    case NumberType::kFloat64:
      return Load<double>(bytes, scan.big_endian);
  }
  throw LogicError("numbers of no type");
}

class SliceCutter {
 public:
  SliceCutter(const Scan& scan, const ImportOptions& options, std::string origin)
      : scan_(scan), options_(options), origin_(std::move(origin)) {}

  void Cut(std::int64_t i, std::int64_t j, RdSlice& slice) {
    const unsigned char* corner =
        scan_.data + j * scan_.stride[kY] + i * scan_.stride[kX];
    std::size_t at = 0;
    for (std::int64_t c = 0; c < scan_.extent[kC]; ++c) {
      for (std::int64_t v = 0; v < scan_.extent[kV]; ++v) {
        for (std::int64_t u = 0; u < scan_.extent[kU]; ++u) {
          const double value =
              LoadNumber(scan_,
                         corner + c * scan_.stride[kC] + v * scan_.stride[kV] +
                             u * scan_.stride[kU]) *
              options_.scale;
          slice.rd[at++] = Checked(static_cast<float>(value), {j, i, v, u, c});
        }
      }
    }
  }

  std::int64_t clamped_count() const { return clamped_count_; }

 private:
  float Checked(float value, const std::array<std::int64_t, kAxisCount>& place) {
    if (std::isfinite(value) && !(value < 0)) {
      return value;
    }
    if (std::isfinite(value) && options_.clamp_negative) {
      ++clamped_count_;
      return 0;
    }
    throw BadData(fmt::format(
        "{}: value {} at (y, x, v, u, c) = {}, from 0 at the top left; R_d is finite "
        "and not negative{}",
        origin_,
        value,
        place,
        std::isfinite(value) ? "; --clamp-negative reads it as 0" : ""));
  }

  Scan scan_;
  ImportOptions options_;
  std::string origin_;
  std::int64_t clamped_count_ = 0;
};

// Sizes beyond an int are beyond Validate's limits too.
int Whole(std::int64_t value) {
  return static_cast<int>(std::clamp<std::int64_t>(value, 0, 1 << 30));
}

}  // namespace

ImportSummary ImportArray(const ArrayView& array,
                          const std::filesystem::path& from,
                          const std::filesystem::path& to,
                          const ImportOptions& options,
                          const ArrayImportOptions& array_options,
                          const ProgressFunction& progress) {
  nacre::Validate(options);
  nacre::Validate(array_options);
  const std::string origin = from.string();
  const Scan scan = Arrange(array, array_options, origin);
  if (scan.extent[kV] != scan.extent[kU] || scan.extent[kU] % 2 == 0) {
    throw BadData(
        fmt::format("{}: windows of {} x {} cells, which should be square and odd; "
                    "check --axes (the array is {})",
                    origin,
                    scan.extent[kU],
                    scan.extent[kV],
                    array.extent));
  }
  RdHeader header;
  header.points_x = Whole(scan.extent[kX]);
  header.points_y = Whole(scan.extent[kY]);
  header.core = Whole(scan.extent[kU]);
  header.pitch_mm = options.pitch_mm;
  header.eta = options.eta;
  constexpr std::int64_t kMostChannels = 1024;
  if (scan.extent[kC] > kMostChannels) {
    throw BadData(fmt::format("{}: {} channels, more than {}; check --axes",
                              origin,
                              scan.extent[kC],
                              kMostChannels));
  }
  header.channels = ChannelNames(array_options.channels, scan.extent[kC], origin);
  Provenance provenance{.command = "import", .options = OptionsToJson(options)};
  provenance.options.update(OptionsToJson(array_options));
  provenance.options["from"] = array.format;
  provenance.AddInput(from);
  header.provenance = provenance.ToString();
  Validate(header, origin);

  RdWriter writer(to, header);
  SliceCutter cutter(scan, options, origin);
  RdSlice slice = MakeSlice(header);
  for (int j = 0; j < header.points_y; ++j) {
    Report(progress, {"import", j, header.points_y, ""});
    for (int i = 0; i < header.points_x; ++i) {
      cutter.Cut(i, j, slice);
      writer.WriteSlice(i, j, slice);
    }
  }
  writer.Finish();
  Report(progress, {"import", header.points_y, header.points_y, ""});
  return {.points_x = header.points_x,
          .points_y = header.points_y,
          .core = header.core,
          .channel_count = static_cast<int>(header.channels.size()),
          .clamped_count = cutter.clamped_count()};
}

}  // namespace nacre::reconstruct
