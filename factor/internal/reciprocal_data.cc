#include "factor/internal/reciprocal_data.h"

#include "core/parallel.h"
#include "factor/internal/reciprocal_sides.h"
#include "factor/internal/reuse.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>

namespace nacre::factor::internal {
namespace {

constexpr double kTolerance = 0.01;  // of the peak, at the peak
constexpr double kFaintest = 1e-5;   // peaks
constexpr double kSidesBytes =
    12 * 4 * 4;                     // near offsets, values and weights both ways
constexpr double kMostPairs = 1e7;  // more take minutes, and tell no more of the maps
// Values and weights, and linearised weights or what FitRest holds: floats.
double BytesAPair(const ReciprocalLimits& limits) {
  return limits.rest ? 4 * 4 : 3 * 4;
}

double PlaneSize(const reconstruct::RdHeader& header) {
  return (header.points_x + header.core - 1.0) * (header.points_y + header.core - 1.0);
}

std::size_t CellCount(const reconstruct::RdHeader& header) {
  return static_cast<std::size_t>(header.WindowSize() + 1) / 2;
}

std::size_t HeldCount(const reconstruct::RdHeader& header,
                      const ReciprocalLimits& limits) {
  const double a_cell = BytesAPair(limits) * PlaneSize(header) *
                        static_cast<double>(header.channels.size());
  const double fitting =
      std::min(limits.memory_bytes, kMostPairs * BytesAPair(limits)) / a_cell;
  return static_cast<std::size_t>(
      std::clamp(fitting, 1.0, static_cast<double>(CellCount(header))));
}

// Of all offsets by distance, the nearer half of what fits, and the rest evenly spread
// over the others.
void ChooseHeld(std::size_t count, ReciprocalData& data) {
  std::vector<int> order(data.cells);
  std::iota(order.begin(), order.end(), 0);
  const auto squared = [&](int cell) {
    const int u = data.OffsetX(static_cast<std::size_t>(cell));
    const int v = data.OffsetY(static_cast<std::size_t>(cell));
    return u * u + v * v;
  };
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    return squared(a) < squared(b);
  });
  const std::size_t near = count == data.cells ? count : (count + 1) / 2;
  data.held.assign(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(near));
  data.share.assign(near, 1.0F);
  const std::size_t far = count - near;
  for (std::size_t n = 0; n < far; ++n) {
    const double step =
        static_cast<double>(data.cells - near) / static_cast<double>(far);
    const auto at =
        near + static_cast<std::size_t>((static_cast<double>(n) + 0.5) * step);
    data.held.push_back(order[std::min(at, data.cells - 1)]);
    data.share.push_back(static_cast<float>(step));
  }
}

// What noise alone may come to where sigma doesn't tell, mm⁻².
double NoiseFloor(const ChannelScan& scan) {
  return std::max(0.0, -0.5 * scan.least);
}

struct Sums {
  double value = 0;
  double squared_sigma = 0;
  double used = 0;
};

// Adds blocks of slices to the pairs of one channel and offset, both ways round.
class PairAdder {
 public:
  PairAdder(const Job& job,
            std::size_t channel,
            std::size_t cell,
            PairSides* sides,
            ReciprocalData& data)
      : header_(job.source.header()),
        channel_(channel),
        cell_(cell),
        data_(data),
        sides_(sides),
        scale_(1 / data.scale[channel]),
        floor_(NoiseFloor(job.scans[channel]) * scale_) {
    const auto found =
        std::find(data.held.begin(), data.held.end(), static_cast<int>(cell));
    if (found != data.held.end()) {
      const std::size_t at =
          data.HeldOffset(channel, static_cast<std::size_t>(found - data.held.begin()));
      value_ = &data.pairs.value[at];
      weight_ = &data.pairs.weight[at];
    }
    if (!data.HoldsAll()) {
      const std::size_t at = data.SampleOffset(channel, cell);
      sample_value_ = &data.sample.value[at];
      sample_weight_ = &data.sample.weight[at];
    }
  }

  void Add(const SliceBlock& block, Sums& sums) {
    const auto window = static_cast<std::size_t>(header_.WindowSize());
    const std::size_t mirrored = window - 1 - cell_;
    for (std::int64_t row = 0; row < block.count; ++row) {
      const std::int64_t point = block.first + row;
      const auto x = static_cast<int>(point % header_.points_x) + data_.margin;
      const auto y = static_cast<int>(point / header_.points_x) + data_.margin;
      const std::size_t slice =
          static_cast<std::size_t>(row * header_.SliceSize()) + channel_ * window;
      AddOne(block, slice + cell_, x, y, sides_ ? &sides_->first : nullptr, sums);
      if (mirrored != cell_) {
        AddOne(block,
               slice + mirrored,
               x - data_.OffsetX(cell_),
               y - data_.OffsetY(cell_),
               sides_ ? &sides_->second : nullptr,
               sums);
      }
    }
  }

 private:
  void AddOne(const SliceBlock& block,
              std::size_t from,
              int x,
              int y,
              Pairs* side,
              Sums& sums) {
    if (block.valid[from] == 0) {
      return;
    }
    const double value = static_cast<double>(block.rd[from]) * scale_;
    double sigma =
        block.sigma == nullptr ? 0 : static_cast<double>(block.sigma[from]) * scale_;
    if (!(sigma > 0)) {
      sigma = floor_;
    }
    sums.value += value;
    sums.squared_sigma += sigma * sigma;
    sums.used += 1;
    const auto at = static_cast<std::size_t>(std::int64_t{y} * data_.width + x);
    if (side != nullptr) {
      side->value[at] = static_cast<float>(value);
      side->weight[at] = static_cast<float>(sigma * sigma);
      return;
    }
    if (value_ != nullptr) {
      Merge(value, sigma, value_[at], weight_[at]);
    }
    if (sample_value_ != nullptr && at % data_.stride == cell_ % data_.stride) {
      const std::size_t n = at / data_.stride;
      Merge(value, sigma, sample_value_[n], sample_weight_[n]);
    }
  }

  // Each pair has at most two measurements; weight is −1 where there was none.
  static void Merge(double value, double sigma, float& to, float& weight) {
    if (weight < 0) {
      to = static_cast<float>(value);
      weight = static_cast<float>(sigma * sigma);
    } else {
      to = static_cast<float>(0.5 * (static_cast<double>(to) + value));
      weight = static_cast<float>(0.25 * (static_cast<double>(weight) + sigma * sigma));
    }
  }

  const reconstruct::RdHeader& header_;
  std::size_t channel_;
  std::size_t cell_;
  ReciprocalData& data_;
  PairSides* sides_;  // where both measurements of a pair go instead
  double scale_;
  double floor_;
  float* value_ = nullptr;
  float* weight_ = nullptr;
  float* sample_value_ = nullptr;
  float* sample_weight_ = nullptr;
};

// Calls work(block) for all slices.
template <class Work>
void ForBlocks(Job& job, const char* note, Work&& work) {
  const std::int64_t points = job.source.header().PointCount();
  for (std::int64_t first = 0; first < points; first += kBlockRows) {
    Report(job.progress, {"factor", first, points, note});
    work(job.source.Read(first, std::min(kBlockRows, points - first)));
  }
  ++job.passes;
}

// Of the slices that stand for all.
std::vector<Sums> SampleSums(const Job& job, const ReciprocalData& data) {
  const reconstruct::RdDataset& sample = job.check.dataset;
  const auto window = static_cast<std::size_t>(sample.header.WindowSize());
  std::vector<Sums> sums(data.channels * data.cells);
  for (std::size_t n = 0; n < sample.rd.size(); ++n) {
    if (sample.valid[n] == 0) {
      continue;
    }
    const std::size_t channel = n / window % data.channels;
    const std::size_t cell = n % window;
    double sigma = sample.sigma.empty() ? 0 : static_cast<double>(sample.sigma[n]);
    if (!(sigma > 0)) {
      sigma = NoiseFloor(job.scans[channel]);
    }
    const double scale = 1 / data.scale[channel];
    Sums& sum = sums[channel * data.cells + std::min(cell, window - 1 - cell)];
    sum.value += static_cast<double>(sample.rd[n]) * scale;
    sum.squared_sigma += sigma * sigma * scale * scale;
    sum.used += 1;
  }
  return sums;
}

void SetMeans(const Job& job, const std::vector<Sums>& sums, ReciprocalData& data) {
  for (std::size_t n = 0; n < sums.size(); ++n) {
    const std::size_t c = n / data.cells;
    const Sums& sum = sums[n];
    const double used = std::max(sum.used, 1.0);
    // Offsets that no pair has are as their ring.
    data.mean.push_back(sum.used > 0
                            ? sum.value / used
                            : job.scans[c].mean[n % data.cells] / data.scale[c]);
    data.noise.push_back(std::sqrt(sum.squared_sigma / used));
  }
}

// Adds up slices into the job's totals. Returns whether all of them was measured.
bool AddTotals(Job& job, const SliceBlock& block) {
  const reconstruct::RdHeader& header = job.source.header();
  const std::int64_t window = header.WindowSize();
  const auto channels = std::ssize(header.channels);
  std::vector<std::uint8_t> complete(static_cast<std::size_t>(block.count), 1);
  ParallelFor(block.count, job.options.thread_count, [&](std::int64_t row) {
    for (std::int64_t c = 0; c < channels; ++c) {
      const std::int64_t at = row * header.SliceSize() + c * window;
      double total = 0;
      for (std::int64_t cell = 0; cell < window; ++cell) {
        if (block.valid[at + cell] == 0) {
          complete[static_cast<std::size_t>(row)] = 0;
        } else {
          total += static_cast<double>(block.rd[at + cell]);
        }
      }
      job.totals[static_cast<std::size_t>(c * header.PointCount() + block.first +
                                          row)] = total;
    }
  });
  return std::find(complete.begin(), complete.end(), 0) == complete.end();
}

}  // namespace

PlaneArea AreaOf(const ReciprocalData& data, std::size_t cell) {
  const int du = data.OffsetX(cell);
  const int dv = data.OffsetY(cell);
  return {std::max(0, -du),
          data.width - std::max(0, du),
          std::max(0, -dv),
          data.height - std::max(0, dv)};
}

double Tolerance(double value, double q) {
  return kTolerance * kTolerance * std::pow(std::max(value, 0.0) + kFaintest, q);
}

double ReciprocalBytes(const reconstruct::RdHeader& header,
                       const ReciprocalLimits& limits) {
  const auto channels = static_cast<double>(header.channels.size());
  const auto held = static_cast<double>(HeldCount(header, limits));
  const auto cells = static_cast<double>(CellCount(header));
  const double sample =
      held < cells ? cells * channels * 8 * (limits.sample_pairs + 1) : 0;
  const double sides = limits.sides ? kSidesBytes * PlaneSize(header) * channels : 0;
  return BytesAPair(limits) * PlaneSize(header) * channels * held + sample + sides;
}

ReciprocalData ReadReciprocal(Job& job,
                              const ReciprocalLimits& limits,
                              SharedMaps& start) {
  const reconstruct::RdHeader& header = job.source.header();
  ReciprocalData data;
  data.margin = header.Radius();
  data.width = header.points_x + 2 * data.margin;
  data.height = header.points_y + 2 * data.margin;
  data.core = header.core;
  data.tail_weight = limits.tail_weight;
  data.channels = header.channels.size();
  data.cells = CellCount(header);
  for (const ChannelScan& scan : job.scans) {
    data.scale.push_back(scan.peak > 0 ? scan.peak : 1);
  }
  ChooseHeld(HeldCount(header, limits), data);
  const std::size_t held = data.channels * data.held.size() * data.Plane();
  data.pairs = {std::vector<float>(held, 0.0F), std::vector<float>(held, -1.0F)};
  data.stride = std::max<std::size_t>(
      1, data.Plane() / static_cast<std::size_t>(limits.sample_pairs));
  // A common divisor would leave out whole columns.
  while (std::gcd(data.stride, static_cast<std::size_t>(data.width)) > 1) {
    --data.stride;
  }
  data.sample_size = data.Plane() / data.stride + 1;
  if (!data.HoldsAll()) {
    const std::size_t size = data.channels * data.cells * data.sample_size;
    data.sample = {std::vector<float>(size, 0.0F), std::vector<float>(size, -1.0F)};
  }
  const std::vector<int> near = limits.sides ? NearCells(data) : std::vector<int>{};
  std::vector<PairSides> sides(near.size() * data.channels, PairSides(data.Plane()));
  const bool once = !job.check.rows.empty();
  std::vector<Sums> sums(data.channels * data.cells);
  std::unique_ptr<StartingMaps> starting;
  if (once) {
    SetMeans(job, SampleSums(job, data), data);
    starting = std::make_unique<StartingMaps>(job, data, limits.terms);
    job.totals.assign(data.channels * static_cast<std::size_t>(header.PointCount()),
                      0.0);
  }
  bool complete = true;
  ForBlocks(job, "pairs", [&](const SliceBlock& block) {
    ParallelFor(std::ssize(sums), job.options.thread_count, [&](std::int64_t n) {
      const auto at = static_cast<std::size_t>(n);
      const std::size_t channel = at / data.cells;
      const std::size_t cell = at % data.cells;
      const auto found = std::find(near.begin(), near.end(), static_cast<int>(cell));
      PairSides* both = nullptr;
      if (found != near.end()) {
        both = &sides[channel * near.size() +
                      static_cast<std::size_t>(found - near.begin())];
      }
      PairAdder(job, channel, cell, both, data).Add(block, sums[at]);
    });
    if (once) {
      complete = AddTotals(job, block) && complete;
      starting->Add(block);
    }
  });
  if (once && !std::all_of(job.totals.begin(), job.totals.end(), [](double total) {
        return std::isfinite(total);
      })) {
    LookAtAll(job);  // says where
  }
  if (limits.sides) {
    FitSides(sides, job.options.thread_count, data);
    MergeSides(sides, data);
  }
  if (once) {
    start = starting->Finish();
    if (!complete) {
      job.totals.clear();
    }
    return data;
  }
  SetMeans(job, sums, data);
  if (!KeepsMaps(job)) {
    StartingMaps maps(job, data, limits.terms);
    ForBlocks(job, "starting maps", [&](const SliceBlock& block) { maps.Add(block); });
    start = maps.Finish();
  }
  return data;
}

}  // namespace nacre::factor::internal
