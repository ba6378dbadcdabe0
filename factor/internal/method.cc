#include "factor/internal/method.h"

#include "core/random.h"
#include "factor/internal/block_svd.h"
#include "factor/internal/equal_rows.h"
#include "factor/internal/log_svd.h"
#include "factor/internal/reuse.h"
#include "reconstruct/clustering.h"

#include <algorithm>
#include <cmath>

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
    if (block.sigma != nullptr) {
      to.sigma.insert(to.sigma.end(), block.sigma, block.sigma + size);
    }
  }
  return sample;
}

namespace {

// Every n-th of its slices, `wanted` of them.
Sample Thin(const Sample& from, std::int64_t wanted) {
  const auto count = static_cast<std::int64_t>(from.rows.size());
  const std::int64_t kept = std::min(wanted, count);
  const std::int64_t size = from.dataset.header.SliceSize();
  Sample thin;
  thin.dataset.header = from.dataset.header;
  thin.dataset.header.points_x = static_cast<int>(kept);
  for (std::int64_t n = 0; n < kept; ++n) {
    const std::int64_t row = n * count / kept;
    thin.rows.push_back(from.rows[static_cast<std::size_t>(row)]);
    const auto add = [&](const auto& values, auto& to) {
      const auto first = values.begin() + row * size;
      to.insert(to.end(), first, first + size);
    };
    add(from.dataset.rd, thin.dataset.rd);
    add(from.dataset.valid, thin.dataset.valid);
    if (!from.dataset.sigma.empty()) {
      add(from.dataset.sigma, thin.dataset.sigma);
    }
  }
  return thin;
}

bool OneReadingMayDo(const reconstruct::RdHeader& header,
                     const FactorOptions& options) {
  if (options.method == "reciprocal") {
    return header.PointCount() >= 2 * kSvdSampleRows && options.check_slices > 0;
  }
  return IsSvd(options.method) && options.clusters == 1 && options.check_slices > 0 &&
         !options.one_by_one && !options.divide_falloff &&
         BlocksPay(header, options.terms);
}

bool IsComplete(const reconstruct::RdDataset& dataset) {
  return std::all_of(dataset.valid.begin(),
                     dataset.valid.end(),
                     [](std::uint8_t valid) { return valid != 0; }) &&
         std::all_of(dataset.rd.begin(), dataset.rd.end(), [](float value) {
           return std::isfinite(value);
         });
}

}  // namespace

bool IsSvd(const std::string& method) {
  return method == "log-svd" || method == "svd" || method == "sqrt-svd";
}

void LookAtAll(Job& job) {
  job.source.Know(nullptr, nullptr);
  job.check = {};
  job.totals.clear();
  job.sample = TakeSample(job.source, job.options.sample_rows, job.options.seed);
  if (job.distinct != nullptr) {
    job.scans = Scan(*job.distinct, job.options.thread_count);
    return;
  }
  job.scans = Scan(job.source, job.options.thread_count);
  ++job.passes;
}

void Look(Job& job) {
  const reconstruct::RdHeader& header = job.source.header();
  if (job.distinct == nullptr && OneReadingMayDo(header, job.options)) {
    job.check = TakeSample(job.source,
                           std::max(kSvdSampleRows, job.options.check_slices),
                           job.options.seed);
    if (IsComplete(job.check.dataset)) {
      job.source.Know(&job.check.rows, &job.check.dataset);
      job.sample = Thin(job.check, job.options.sample_rows);
      job.scans = Scan(*SourceOf(job.check.dataset), job.options.thread_count);
      for (ChannelScan& scan : job.scans) {
        scan.used = header.PointCount() * header.WindowSize();
      }
      return;
    }
  }
  LookAtAll(job);
}

reconstruct::Clustering ClusterSlices(Job& job) {
  if (KeepsClusters(job)) {
    reconstruct::Clustering clustering;
    clustering.labels = job.made->cluster;
    clustering.cluster_count = job.made->cluster_count;
    return clustering;
  }
  ++job.passes;
  return job.clusterer({.clusters = job.options.clusters,
                        .seed = job.options.seed,
                        .thread_count = job.options.thread_count,
                        .ranks = job.options.ranks},
                       job.progress);
}

Job::~Job() {
  source.Know(nullptr, nullptr);
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

void ForLots(Job& job,
             const RowLots& lots,
             const char* note,
             const std::function<void(const SliceBlock&)>& of_block,
             const std::function<void()>& end_of_lot) {
  const std::int64_t points = job.source.header().PointCount();
  const RankShare own = ShareOf(lots.count(), job.options.ranks);
  for (std::int64_t lot = own.begin; lot < own.end; ++lot) {
    const std::int64_t end = lots.Begin(lot + 1);
    for (std::int64_t first = lots.Begin(lot); first < end; first += kBlockRows) {
      Report(job.progress, {"factor", first, points, note});
      of_block(job.source.Read(first, std::min(kBlockRows, end - first)));
    }
    end_of_lot();
  }
  ++job.passes;
}

void JoinMaps(const Job& job, const RowLots& lots, std::vector<float>& maps) {
  const auto points = static_cast<std::size_t>(job.source.header().PointCount());
  for (std::size_t begin = 0; begin < maps.size(); begin += points) {
    lots.Join(job.options.ranks, std::span(maps).subspan(begin, points));
  }
}

}  // namespace nacre::factor::internal
