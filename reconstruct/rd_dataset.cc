#include "reconstruct/rd_dataset.h"

#include "core/error.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <set>

namespace nacre::reconstruct {
namespace {

// Far above any rig, far below what overflows: pictures of a dataset have
// points · core pixels a side, which OpenEXR counts in an int.
constexpr int kMaxPoints = 1 << 20;
constexpr int kMaxCore = 4095;
constexpr std::size_t kMaxChannels = 1024;

}  // namespace

void Validate(const RdHeader& header, const std::string& origin) {
  const auto check = [&](bool good, const char* field, const std::string& found) {
    if (!good) {
      throw BadData(fmt::format("{}: {} is {}", origin, field, found));
    }
  };
  check(header.points_x >= 1 && header.points_x <= kMaxPoints,
        "points_x",
        fmt::format("{}, not between 1 and {}", header.points_x, kMaxPoints));
  check(header.points_y >= 1 && header.points_y <= kMaxPoints,
        "points_y",
        fmt::format("{}, not between 1 and {}", header.points_y, kMaxPoints));
  check(header.core >= 1 && header.core <= kMaxCore && header.core % 2 == 1,
        "core",
        fmt::format("{}, not odd and between 1 and {}", header.core, kMaxCore));
  check(
      std::int64_t{std::max(header.points_x, header.points_y)} * header.core < 1 << 30,
      "core",
      fmt::format("{}: too large for {} x {} points",
                  header.core,
                  header.points_x,
                  header.points_y));
  check(std::isfinite(header.pitch_mm) && header.pitch_mm > 0,
        "pitch_mm",
        fmt::format("{}, not a positive number of millimetres", header.pitch_mm));
  check(header.eta >= 1 && header.eta <= 10,
        "eta",
        fmt::format("{}, not a refractive index between 1 and 10", header.eta));
  check(!header.channels.empty() && header.channels.size() <= kMaxChannels,
        "channels",
        fmt::format(
            "a list of {} names, not 1 to {}", header.channels.size(), kMaxChannels));
  std::set<std::string> seen;
  for (const std::string& channel : header.channels) {
    check(!channel.empty() && channel.size() < 256 &&
              channel.find('\0') == std::string::npos,
          "channels",
          fmt::format("wrong: '{}' is not a name of 1 to 255 characters", channel));
    check(seen.insert(channel).second,
          "channels",
          fmt::format("wrong: '{}' is named twice", channel));
  }
}

RdSlice MakeSlice(const RdHeader& header) {
  const auto size = static_cast<std::size_t>(header.SliceSize());
  return {std::vector<float>(size, 0.0F),
          std::vector<float>(size, 0.0F),
          std::vector<std::uint8_t>(size, 1)};
}

RdDataset ReadDataset(const std::filesystem::path& path) {
  RdReader reader(path);
  RdDataset dataset;
  dataset.header = reader.header();
  const RdHeader& header = dataset.header;
  const auto size = static_cast<std::size_t>(header.PointCount() * header.SliceSize());
  dataset.rd.reserve(size);
  dataset.sigma.reserve(size);
  dataset.valid.reserve(size);
  for (int j = 0; j < header.points_y; ++j) {
    for (int i = 0; i < header.points_x; ++i) {
      const RdSlice slice = reader.ReadSlice(i, j);
      dataset.rd.insert(dataset.rd.end(), slice.rd.begin(), slice.rd.end());
      dataset.sigma.insert(dataset.sigma.end(), slice.sigma.begin(), slice.sigma.end());
      dataset.valid.insert(dataset.valid.end(), slice.valid.begin(), slice.valid.end());
    }
  }
  return dataset;
}

void WriteDataset(const std::filesystem::path& path, const RdDataset& dataset) {
  const RdHeader& header = dataset.header;
  RdWriter writer(path, header);
  const auto values =
      static_cast<std::size_t>(header.PointCount() * header.SliceSize());
  Expect(dataset.rd.size() == values && dataset.sigma.size() == values &&
             dataset.valid.size() == values,
         "points * channels * core * core values");
  RdSlice slice;
  for (std::int64_t s = 0; s < header.PointCount(); ++s) {
    const std::ptrdiff_t begin = s * header.SliceSize();
    const std::ptrdiff_t end = begin + header.SliceSize();
    slice.rd.assign(dataset.rd.begin() + begin, dataset.rd.begin() + end);
    slice.sigma.assign(dataset.sigma.begin() + begin, dataset.sigma.begin() + end);
    slice.valid.assign(dataset.valid.begin() + begin, dataset.valid.begin() + end);
    writer.WriteSlice(static_cast<int>(s % header.points_x),
                      static_cast<int>(s / header.points_x),
                      slice);
  }
  writer.Finish();
}

}  // namespace nacre::reconstruct
