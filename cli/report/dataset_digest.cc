#include "cli/report/dataset_digest.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <set>

namespace nacre::cli::report {
namespace {

using reconstruct::RdHeader;
using reconstruct::RdSlice;

// Where the slices that are shown come from: spread over the grid, off its symmetry
// axes, since patterns often share those.
std::set<std::int64_t> SamplePlaces(const RdHeader& header) {
  constexpr double kPlaces[][2] = {
      {0.5, 0.5}, {0.31, 0.36}, {0.69, 0.31}, {0.36, 0.72}, {0.62, 0.62}, {0.08, 0.9}};
  std::set<std::int64_t> places;
  for (const auto& place : kPlaces) {
    places.insert(static_cast<std::int64_t>(place[1] * header.points_y) *
                      header.points_x +
                  static_cast<std::int64_t>(place[0] * header.points_x));
  }
  return places;
}

struct PairSums {
  double difference2 = 0;
  double signal2 = 0;
  double variance = 0;

  static double Ratio(double part, double whole) {
    return whole > 0 ? std::sqrt(part / whole) : 0;
  }
};

class Digester {
 public:
  explicit Digester(const RdHeader& header)
      : header_(header),
        window_(static_cast<std::size_t>(header.WindowSize())),
        ring_of_(window_),
        pairs_(header.channels.size()),
        point_pairs_(static_cast<std::size_t>(header.PointCount())) {
    digest_.header = header;
    const auto points = static_cast<std::size_t>(header.PointCount());
    digest_.albedo.assign(header.channels.size(), std::vector<float>(points, 0.0F));
    digest_.peak.assign(header.channels.size(), 0.0);
    digest_.valid_fraction.assign(points, 0.0F);
    for (std::size_t cell = 0; cell < window_; ++cell) {
      const int u = static_cast<int>(cell) % header.core - header.Radius();
      const int v = static_cast<int>(cell) / header.core - header.Radius();
      ring_of_[cell] = static_cast<std::size_t>(std::lround(std::hypot(u, v)));
    }
    ring_means_.assign(
        header.channels.size(),
        std::vector<std::vector<float>>(static_cast<std::size_t>(header.Radius()) + 1));
  }

  void Add(int i, int j, RdSlice slice) {
    const std::size_t point =
        static_cast<std::size_t>(j) * static_cast<std::size_t>(header_.points_x) +
        static_cast<std::size_t>(i);
    std::int64_t valid_count = 0;
    for (std::size_t c = 0; c < header_.channels.size(); ++c) {
      valid_count += AddChannel(point, c, slice);
    }
    digest_.valid_fraction[point] =
        static_cast<float>(valid_count) / static_cast<float>(header_.SliceSize());
    valid_total_ += valid_count;
    if (i == 0) {
      rows_.emplace_back();
      if (static_cast<int>(rows_.size()) > header_.Radius() + 1) {
        rows_.pop_front();
      }
    }
    rows_.back().push_back(std::move(slice));
    Compare(i, j);
  }

  void Keep(int i, int j) { digest_.samples.push_back({i, j, rows_.back().back().rd}); }

  DatasetDigest Finish() {
    for (std::size_t c = 0; c < header_.channels.size(); ++c) {
      digest_.profiles.push_back(ProfileOf(ring_means_[c]));
      digest_.asymmetry.push_back(
          PairSums::Ratio(pairs_[c].difference2, pairs_[c].signal2));
      digest_.noise_asymmetry.push_back(
          PairSums::Ratio(pairs_[c].variance, pairs_[c].signal2));
    }
    for (const PairSums& sums : point_pairs_) {
      digest_.asymmetry_map.push_back(
          static_cast<float>(PairSums::Ratio(sums.difference2, sums.signal2)));
    }
    digest_.missing =
        1 - static_cast<double>(valid_total_) /
                static_cast<double>(header_.PointCount() * header_.SliceSize());
    digest_.noise = PairSums::Ratio(variance_, signal2_);
    return std::move(digest_);
  }

 private:
  std::int64_t AddChannel(std::size_t point,
                          std::size_t channel,
                          const RdSlice& slice) {
    double sum = 0;
    std::int64_t valid_count = 0;
    std::vector<double> ring_sum(ring_means_[channel].size(), 0.0);
    std::vector<double> ring_count(ring_sum.size(), 0.0);
    for (std::size_t cell = 0; cell < window_; ++cell) {
      const std::size_t n = channel * window_ + cell;
      if (slice.valid[n] == 0) {
        continue;
      }
      const auto rd = static_cast<double>(slice.rd[n]);
      ++valid_count;
      sum += rd;
      signal2_ += rd * rd;
      variance_ += std::pow(static_cast<double>(slice.sigma[n]), 2);
      digest_.peak[channel] = std::max(digest_.peak[channel], rd);
      if (ring_of_[cell] < ring_sum.size()) {
        ring_sum[ring_of_[cell]] += rd;
        ring_count[ring_of_[cell]] += 1;
      }
    }
    digest_.albedo[channel][point] = static_cast<float>(sum * header_.CellAreaMm2());
    for (std::size_t ring = 0; ring < ring_sum.size(); ++ring) {
      if (ring_count[ring] > 0) {
        ring_means_[channel][ring].push_back(
            static_cast<float>(ring_sum[ring] / ring_count[ring]));
      }
    }
    return valid_count;
  }

  // The newest slice with every one before it whose windows reach each other.
  void Compare(int i, int j) {
    const int radius = header_.Radius();
    for (int v = 0; v <= radius; ++v) {
      const int other_j = j + v - radius;
      if (other_j < 0) {
        continue;
      }
      const std::vector<RdSlice>& row =
          rows_[rows_.size() - 1 - static_cast<std::size_t>(j - other_j)];
      const int u_end = v < radius ? header_.core : radius;
      for (int u = 0; u < u_end; ++u) {
        const int other_i = i + u - radius;
        if (other_i >= 0 && other_i < header_.points_x) {
          ComparePair({rows_.back().back(), row[static_cast<std::size_t>(other_i)]},
                      static_cast<std::size_t>(std::int64_t{v} * header_.core + u),
                      {PointIndex(i, j), PointIndex(other_i, other_j)});
        }
      }
    }
  }

  struct SlicePair {
    const RdSlice& a;
    const RdSlice& b;
  };

  void ComparePair(const SlicePair& slices,
                   std::size_t cell,
                   const std::array<std::size_t, 2>& points) {
    const std::size_t mirrored = window_ - 1 - cell;  // −d
    for (std::size_t c = 0; c < header_.channels.size(); ++c) {
      const std::size_t at_a = c * window_ + cell;
      const std::size_t at_b = c * window_ + mirrored;
      if (slices.a.valid[at_a] == 0 || slices.b.valid[at_b] == 0) {
        continue;
      }
      const auto a = static_cast<double>(slices.a.rd[at_a]);
      const auto b = static_cast<double>(slices.b.rd[at_b]);
      const double sigma2 = std::pow(static_cast<double>(slices.a.sigma[at_a]), 2) +
                            std::pow(static_cast<double>(slices.b.sigma[at_b]), 2);
      const auto add = [&](PairSums& sums) {
        sums.difference2 += (a - b) * (a - b);
        sums.signal2 += a * a + b * b;
        sums.variance += sigma2;
      };
      add(pairs_[c]);
      add(point_pairs_[points[0]]);
      add(point_pairs_[points[1]]);
    }
    ++digest_.pair_count;
  }

  std::size_t PointIndex(int i, int j) const {
    return static_cast<std::size_t>(j) * static_cast<std::size_t>(header_.points_x) +
           static_cast<std::size_t>(i);
  }

  RadialProfile ProfileOf(std::vector<std::vector<float>>& rings) const {
    RadialProfile profile;
    for (std::size_t ring = 0; ring < rings.size(); ++ring) {
      std::vector<float>& values = rings[ring];
      if (values.empty()) {
        continue;
      }
      std::sort(values.begin(), values.end());
      double sum = 0;
      for (const float value : values) {
        sum += static_cast<double>(value);
      }
      profile.radius_mm.push_back(static_cast<double>(ring) * header_.pitch_mm);
      profile.mean.push_back(sum / static_cast<double>(values.size()));
      profile.low.push_back(static_cast<double>(values[values.size() / 10]));
      profile.high.push_back(
          static_cast<double>(values[values.size() - 1 - values.size() / 10]));
    }
    return profile;
  }

  RdHeader header_;
  std::size_t window_;
  std::vector<std::size_t> ring_of_;
  std::vector<std::vector<std::vector<float>>> ring_means_;  // [channel][ring][slice]
  std::vector<PairSums> pairs_;
  std::vector<PairSums> point_pairs_;
  std::deque<std::vector<RdSlice>> rows_;  // the last radius + 1 rows of slices
  std::int64_t valid_total_ = 0;
  double signal2_ = 0;
  double variance_ = 0;
  DatasetDigest digest_;
};

}  // namespace

DatasetDigest Digest(reconstruct::RdReader& reader, const ProgressFunction& progress) {
  const RdHeader& header = reader.header();
  const std::set<std::int64_t> samples = SamplePlaces(header);
  Digester digester(header);
  for (int j = 0; j < header.points_y; ++j) {
    Report(progress, {"report", j, header.points_y, "dataset"});
    for (int i = 0; i < header.points_x; ++i) {
      digester.Add(i, j, reader.ReadSlice(i, j));
      if (samples.contains(std::int64_t{j} * header.points_x + i)) {
        digester.Keep(i, j);
      }
    }
  }
  return digester.Finish();
}

}  // namespace nacre::cli::report
