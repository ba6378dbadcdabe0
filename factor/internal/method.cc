#include "factor/internal/method.h"

#include "core/random.h"

#include <algorithm>

namespace nacre::factor::internal {

Sample TakeSample(SliceSource& source, int wanted, std::uint64_t seed) {
  const reconstruct::RdHeader& header = source.header();
  const std::int64_t count = header.PointCount();
  const std::int64_t rows = std::min<std::int64_t>(count, wanted);
  RandomStream random(seed, 0x666163746F72);  // a stream of this stage's own
  Sample sample;
  sample.dataset.header = header;
  sample.dataset.header.points_x = static_cast<int>(rows);
  sample.dataset.header.points_y = 1;
  for (std::int64_t n = 0; n < rows; ++n) {
    const double place = (static_cast<double>(n) + random.Uniform()) *
                         static_cast<double>(count) / static_cast<double>(rows);
    sample.rows.push_back(std::min(static_cast<std::int64_t>(place), count - 1));
    const SliceBlock block = source.Read(sample.rows.back(), 1);
    const std::int64_t size = header.SliceSize();
    reconstruct::RdDataset& to = sample.dataset;
    to.rd.insert(to.rd.end(), block.rd, block.rd + size);
    to.valid.insert(to.valid.end(), block.valid, block.valid + size);
  }
  return sample;
}

double Job::Peak() const {
  double peak = 0;
  for (const ChannelScan& scan : scans) {
    peak = std::max(peak, scan.peak);
  }
  return peak;
}

Material EmptyMaterial(const reconstruct::RdHeader& header) {
  Material m;
  m.points_x = header.points_x;
  m.points_y = header.points_y;
  m.core = header.core;
  m.pitch_mm = header.pitch_mm;
  m.eta = header.eta;
  m.channels = header.channels;
  const std::size_t channels = header.channels.size();
  const auto points = static_cast<std::size_t>(header.PointCount());
  m.a.assign(channels, 1);
  m.b.assign(channels, 1);
  m.cluster.assign(points, 0);
  m.row_scale.assign(channels * points, 1.0F);
  m.albedo.assign(channels * points, 0.0F);
  return m;
}

}  // namespace nacre::factor::internal
