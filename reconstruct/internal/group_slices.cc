#include "reconstruct/internal/group_slices.h"

#include "core/error.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace nacre::reconstruct::internal {
namespace {

std::vector<std::vector<std::int64_t>> FindPictures(
    const acquire::SessionReader& session) {
  const acquire::Schedule& schedule = session.schedule();
  const int channels = session.rig().ChannelCount();
  std::vector<std::vector<std::int64_t>> pictures(
      static_cast<std::size_t>(schedule.group_count() * channels));
  for (std::int64_t number = schedule.grid_begin(); number < schedule.size();
       ++number) {
    const acquire::ScheduledPicture& picture = schedule[number];
    if (picture.target == acquire::Target::kSample && picture.group >= 0) {
      pictures[static_cast<std::size_t>(picture.group * channels + picture.channel)]
          .push_back(number);
    }
  }
  return pictures;
}

}  // namespace

GroupReader::GroupReader(const acquire::SessionReader& session,
                         const calibrate::Calibration& calibration,
                         const RdHeader& header,
                         double spot_sigma_mm,
                         int thread_count)
    : session_(session),
      calibration_(calibration),
      header_(header),
      weights_(CellLattice(header), calibration.camera, spot_sigma_mm, thread_count),
      pictures_(FindPictures(session)) {
  // RdPerRate is a product of what depends on x_i and what depends on x_o.
  const CellLattice& lattice = weights_.lattice();
  const double at_origin = calibration.RdPerRate(0, {0, 0}, {0, 0}, header.eta);
  exit_factor_.resize(static_cast<std::size_t>(lattice.CellCount()));
  for (int row = 0; row < lattice.rows; ++row) {
    for (int column = 0; column < lattice.columns; ++column) {
      const PointMm centre = lattice.Centre(column, row);
      exit_factor_[static_cast<std::size_t>(lattice.Index(column, row))] =
          calibration.RdPerRate(0, {0, 0}, {centre.x, centre.y}, header.eta) /
          at_origin;
    }
  }
}

RateFrame GroupReader::ReadRates(int group, int channel, GroupSlices& result) const {
  std::vector<acquire::Frame> frames;
  for (const std::int64_t number : pictures_[static_cast<std::size_t>(
           group * session_.rig().ChannelCount() + channel)]) {
    frames.push_back(session_.ReadFrame(number));
  }
  RateFrame rates = MergeExposures(frames, calibration_);
  result.frame_count += std::ssize(frames);
  result.saturated_count += rates.saturated_count;
  return rates;
}

CellWeights::Value GroupReader::Measure(const RateFrame& rates,
                                        std::int64_t cell,
                                        double enter_factor) const {
  CellWeights::Value value = weights_.Mean(rates, cell);
  const double factor = enter_factor * exit_factor_[static_cast<std::size_t>(cell)];
  value.mean *= factor;
  value.variance *= factor * factor;
  return value;
}

// A picture's spots enter at slightly different angles; for tails the first one's
// factor is good enough for all.
void GroupReader::SampleOutside(const RateFrame& rates,
                                int group,
                                int channel,
                                GroupSlices& result) const {
  const auto spots = session_.schedule().Group(group);
  const CellLattice& lattice = weights_.lattice();
  const auto is_outside = [&](int column, int row) {
    return std::none_of(
        spots.begin(), spots.end(), [&](const acquire::GridIndex& spot) {
          return column >= spot.i && column < spot.i + header_.core && row >= spot.j &&
                 row < spot.j + header_.core;
        });
  };
  const PointMm x_i = header_.GridPoint(spots[0].i, spots[0].j);
  const double enter =
      calibration_.RdPerRate(channel, {x_i.x, x_i.y}, {0, 0}, header_.eta);
  // A stride prime to the lattice's width walks through all columns and rows.
  constexpr std::int64_t kSamples = 256;
  std::int64_t stride = std::max<std::int64_t>(1, lattice.CellCount() / kSamples);
  while (std::gcd(stride, std::int64_t{lattice.columns}) != 1) {
    ++stride;
  }
  for (std::int64_t cell = group % stride; cell < lattice.CellCount(); cell += stride) {
    const int column = static_cast<int>(cell % lattice.columns);
    const int row = static_cast<int>(cell / lattice.columns);
    if (!is_outside(column, row)) {
      continue;
    }
    const CellWeights::Value value = Measure(rates, cell, enter);
    if (value.valid) {
      result.outside.push_back({group,
                                channel,
                                column,
                                row,
                                static_cast<float>(value.mean),
                                static_cast<float>(std::sqrt(value.variance))});
    }
  }
}

GroupSlices GroupReader::Read(int group) const {
  const auto spots = session_.schedule().Group(group);
  const CellLattice& lattice = weights_.lattice();
  GroupSlices result;
  result.slices.assign(spots.size(), MakeSlice(header_));
  for (int c = 0; c < static_cast<int>(header_.channels.size()); ++c) {
    const RateFrame rates = ReadRates(group, c, result);
    SampleOutside(rates, group, c, result);
    for (std::size_t k = 0; k < spots.size(); ++k) {
      const auto [i, j] = spots[k];
      const PointMm x_i = header_.GridPoint(i, j);
      const double enter =
          calibration_.RdPerRate(c, {x_i.x, x_i.y}, {0, 0}, header_.eta);
      RdSlice& slice = result.slices[k];
      auto at = static_cast<std::size_t>(c * header_.WindowSize());
      for (int v = 0; v < header_.core; ++v) {
        for (int u = 0; u < header_.core; ++u, ++at) {
          const CellWeights::Value value =
              Measure(rates, lattice.Index(i + u, j + v), enter);
          slice.rd[at] = static_cast<float>(value.mean);
          slice.sigma[at] = static_cast<float>(std::sqrt(value.variance));
          slice.valid[at] = value.valid ? 1 : 0;
          result.invalid_count += value.valid ? 0 : 1;
        }
      }
    }
  }
  return result;
}

std::size_t GroupReader::WorkingBytes() const {
  const auto pixels = static_cast<std::size_t>(calibration_.camera.width_px) *
                      static_cast<std::size_t>(calibration_.camera.height_px);
  std::size_t most_exposures = 0;
  for (const auto& numbers : pictures_) {
    most_exposures = std::max(most_exposures, numbers.size());
  }
  std::size_t most_spots = 0;
  for (int group = 0; group < session_.schedule().group_count(); ++group) {
    most_spots = std::max(most_spots, session_.schedule().Group(group).size());
  }
  constexpr std::size_t kBytesAValue = 2 * sizeof(float) + 1;
  // A frame's file is held beside its counts while it is read.
  return pixels * (2 * (most_exposures + 1) + 2 * sizeof(float)) +
         most_spots * static_cast<std::size_t>(header_.SliceSize()) * kBytesAValue;
}

}  // namespace nacre::reconstruct::internal
