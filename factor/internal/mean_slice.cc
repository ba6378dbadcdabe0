#include "factor/internal/mean_slice.h"

#include "core/error.h"
#include "core/parallel.h"
#include "reconstruct/error_figures.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>

namespace nacre::factor::internal {
namespace {

using reconstruct::RdHeader;

struct Sums {
  ChannelScan scan;
  std::vector<double> total;
  std::vector<std::int64_t> count;
};

void ScanRow(const RdHeader& header,
             const SliceBlock& block,
             std::int64_t row,
             std::size_t channel,
             Sums& sums) {
  const std::int64_t offset = row * header.SliceSize() +
                              static_cast<std::int64_t>(channel) * header.WindowSize();
  const std::int64_t weight = block.weight == nullptr ? 1 : block.weight[row];
  for (std::int64_t cell = 0; cell < header.WindowSize(); ++cell) {
    if (block.valid[offset + cell] == 0) {
      continue;
    }
    const auto rd = static_cast<double>(block.rd[offset + cell]);
    if (!std::isfinite(rd)) {
      const std::int64_t slice = block.first + row;
      throw BadData(fmt::format(
          "slice ({}, {}), channel {}, window cell ({}, {}): R_d is {}; mark "
          "what wasn't measured as invalid",
          slice % header.points_x,
          slice / header.points_x,
          header.channels[channel],
          cell % header.core,
          cell / header.core,
          rd));
    }
    const auto n = static_cast<std::size_t>(cell);
    sums.scan.peak = std::max(sums.scan.peak, rd);
    sums.scan.least = std::min(sums.scan.least, rd);
    sums.scan.sum += static_cast<double>(weight) * rd;
    sums.scan.used += weight;
    sums.total[n] += static_cast<double>(weight) * rd;
    sums.count[n] += weight;
  }
}

// Cells that no slice has: the mean over the cells at the same rounded distance from
// the centre, or of the nearest such ring.
void FillFromRings(const RdHeader& header, Sums& sums) {
  const int radius = header.Radius();
  const auto ring_of = [&](std::size_t cell) {
    const auto u = static_cast<int>(cell) % header.core - radius;
    const auto v = static_cast<int>(cell) / header.core - radius;
    return static_cast<std::size_t>(std::lround(std::hypot(u, v)));
  };
  const std::size_t ring_count = ring_of(0) + 1;
  std::vector<double> total(ring_count, 0.0);
  std::vector<double> count(ring_count, 0.0);
  for (std::size_t cell = 0; cell < sums.count.size(); ++cell) {
    if (sums.count[cell] > 0) {
      total[ring_of(cell)] += sums.scan.mean[cell];
      count[ring_of(cell)] += 1;
    }
  }
  for (std::size_t cell = 0; cell < sums.count.size(); ++cell) {
    if (sums.count[cell] > 0) {
      continue;
    }
    const std::size_t wanted = ring_of(cell);
    std::size_t best = ring_count;
    for (std::size_t ring = 0; ring < ring_count; ++ring) {
      const auto distance = [&](std::size_t r) {
        return r > wanted ? r - wanted : wanted - r;
      };
      if (count[ring] > 0 && (best == ring_count || distance(ring) < distance(best))) {
        best = ring;
      }
    }
    sums.scan.mean[cell] = total[best] / count[best];
  }
}

}  // namespace

std::vector<ChannelScan> Scan(SliceSource& source, int thread_count) {
  const RdHeader& header = source.header();
  const auto window = static_cast<std::size_t>(header.WindowSize());
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  std::vector<Sums> sums(header.channels.size(),
                         {{-kInfinity, kInfinity, 0, 0, {}, {}},
                          std::vector<double>(window, 0.0),
                          std::vector<std::int64_t>(window, 0)});
  for (std::int64_t first = 0; first < header.PointCount(); first += kBlockRows) {
    const SliceBlock block =
        source.Read(first, std::min(kBlockRows, header.PointCount() - first));
    ParallelFor(
        static_cast<std::int64_t>(sums.size()), thread_count, [&](std::int64_t c) {
          for (std::int64_t row = 0; row < block.count; ++row) {
            const auto channel = static_cast<std::size_t>(c);
            ScanRow(header, block, row, channel, sums[channel]);
          }
        });
  }
  std::vector<ChannelScan> scans;
  for (std::size_t c = 0; c < sums.size(); ++c) {
    if (sums[c].scan.used == 0) {
      throw BadData(fmt::format("channel {}: not one value of the dataset is valid",
                                header.channels[c]));
    }
    sums[c].scan.mean.resize(window);
    for (std::size_t cell = 0; cell < window; ++cell) {
      const auto count =
          static_cast<double>(std::max(sums[c].count[cell], std::int64_t{1}));
      sums[c].scan.mean[cell] = sums[c].total[cell] / count;
    }
    FillFromRings(header, sums[c]);
    scans.push_back(std::move(sums[c].scan));
  }
  return scans;
}

std::vector<double> MeanFalloff(const ChannelScan& scan) {
  const double largest = *std::max_element(scan.mean.begin(), scan.mean.end());
  const double scale = largest > 0 ? largest : 1;
  const double least = std::max(-scan.least / scale, reconstruct::kLogFloor);
  std::vector<double> falloff;
  for (const double mean : scan.mean) {
    falloff.push_back(std::max(mean / scale, least));
  }
  return falloff;
}

int FillRow(std::span<const float> rd,
            std::span<const std::uint8_t> valid,
            const ChannelScan& scan,
            std::span<double> filled) {
  double row_sum = 0;
  double mean_sum = 0;
  int missing = 0;
  for (std::size_t cell = 0; cell < rd.size(); ++cell) {
    if (valid[cell] == 0) {
      ++missing;
      continue;
    }
    filled[cell] = static_cast<double>(rd[cell]);
    row_sum += filled[cell];
    mean_sum += scan.mean[cell];
  }
  if (missing == 0) {
    return 0;
  }
  const bool comparable = row_sum > 0 && mean_sum > 0;
  const double scale = comparable ? row_sum / mean_sum : 1;
  for (std::size_t cell = 0; cell < rd.size(); ++cell) {
    if (valid[cell] == 0) {
      filled[cell] = std::clamp(scale * scan.mean[cell], 0.0, std::max(0.0, scan.peak));
    }
  }
  return missing;
}

}  // namespace nacre::factor::internal
