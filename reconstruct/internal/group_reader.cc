#include "reconstruct/internal/group_reader.h"

#include "core/hash.h"

#include <algorithm>
#include <cmath>

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
    if (picture.target == acquire::Target::kSample && picture.group >= 0 &&
        picture.channel >= 0) {
      pictures[static_cast<std::size_t>(std::int64_t{picture.group} * channels +
                                        picture.channel)]
          .push_back(number);
    }
  }
  return pictures;
}

bool IsIdeal(const calibrate::SamplePlane& plane) {
  return plane.height_mm == 0 && plane.slope_x == 0 && plane.slope_y == 0;
}

// Where a beam aimed at a point arrives.
PlaceOnLattice OnPlane(const calibrate::Calibration& calibration,
                       const calibrate::SamplePlane& plane) {
  if (IsIdeal(plane)) {
    return {};
  }
  return [&calibration, plane](PointMm aimed) {
    return calibrate::OnSurface(calibration, plane, aimed);
  };
}

// A beam aimed at x_i arrives elsewhere on a surface that lies higher or lower; the
// lattice goes with the beams. The shift varies too slowly for it to matter at which
// end of it it is taken.
PlaceOnLattice WhereLit(const calibrate::Calibration& calibration,
                        const calibrate::SamplePlane& plane) {
  if (IsIdeal(plane)) {
    return {};
  }
  return [&calibration, plane](PointMm seen) {
    const PointMm lit = calibrate::OnSurface(calibration, plane, seen);
    return PointMm{2 * seen.x - lit.x, 2 * seen.y - lit.y};
  };
}

}  // namespace

GroupReader::GroupReader(const acquire::SessionReader& session,
                         const calibrate::Calibration& calibration,
                         const calibrate::SessionState& state,
                         const RdHeader& header,
                         const calibrate::SpotProfile& spot,
                         int thread_count)
    : session_(session),
      calibration_(calibration),
      state_(state),
      header_(header),
      rings_(calibration, calibration.camera),
      pictures_(FindPictures(session)) {
  std::vector<PointMm> offsets = BeamOffsets(session, calibration, header);
  for (std::int64_t s = 0; s < header.PointCount(); ++s) {
    const PointMm x_i = header.GridPoint(static_cast<int>(s % header.points_x),
                                         static_cast<int>(s / header.points_x));
    const PointMm off = offsets[static_cast<std::size_t>(s)];
    spots_.push_back(
        OnSurface(calibration, state.plane, {x_i.x + off.x, x_i.y + off.y}));
  }
  AddPlanes({.spot = spot,
             .place = WhereLit(calibration, state.plane),
             .on_surface = OnPlane(calibration, state.plane),
             .beam_offsets = std::move(offsets)},
            thread_count);
  const calibrate::Glare& glare = calibration.corrections.glare;
  if (glare.fraction > 0) {
    glare_sigma_ = static_cast<float>(
        std::hypot(glare.fraction_sigma / glare.fraction, GlarePyramid::kError));
  }
  // RdPerRate is a product of what depends on x_i and what depends on x_o.
  const double at_origin = calibration.RdPerRate(0, {0, 0}, {0, 0}, header.eta);
  exit_factor_.reserve(static_cast<std::size_t>(lattice().CellCount()));
  for (int row = 0; row < lattice().rows; ++row) {
    for (int column = 0; column < lattice().columns; ++column) {
      exit_factor_.push_back(static_cast<float>(
          calibration.RdPerRate(0, {0, 0}, lattice().Centre(column, row), header.eta) /
          at_origin));
    }
  }
}

const std::vector<std::int64_t>& GroupReader::Pictures(int group, int channel) const {
  return pictures_[static_cast<std::size_t>(
      std::int64_t{group} * session_.rig().ChannelCount() + channel)];
}

void GroupReader::AddPictures(int group, std::vector<std::int64_t>& numbers) const {
  for (int c = 0; c < session_.rig().ChannelCount(); ++c) {
    const std::vector<std::int64_t>& own = Pictures(group, c);
    numbers.insert(numbers.end(), own.begin(), own.end());
  }
}

bool GroupReader::IsThere(int group) const {
  bool there = true;
  for (int c = 0; c < session_.rig().ChannelCount(); ++c) {
    for (const std::int64_t number : Pictures(group, c)) {
      there = there && number < session_.picture_count();
    }
  }
  return there;
}

std::uint64_t GroupReader::StateOf(int group) const {
  std::string hashes;
  for (int c = 0; c < session_.rig().ChannelCount(); ++c) {
    for (const std::int64_t number : Pictures(group, c)) {
      hashes += session_.Entry(number).hash;
      hashes += '/';
    }
  }
  return Hash64(hashes.data(), hashes.size());
}

std::vector<bool> GroupReader::LitPoints() const {
  const acquire::GridDescription& grid = session_.rig().grid;
  std::vector<bool> lit(static_cast<std::size_t>(grid.PointCount()), false);
  const auto at = [&](const acquire::GridIndex& point) {
    return static_cast<std::size_t>(std::int64_t{point.j} * grid.points_x + point.i);
  };
  for (int group = 0; group < session_.schedule().group_count(); ++group) {
    for (const acquire::GridIndex& point : session_.schedule().Group(group)) {
      lit[at(point)] = true;
    }
  }
  if (session_.manifest().adaptive_plan) {
    for (const acquire::GridIndex& point :
         session_.manifest().adaptive_plan->empty_points) {
      lit[at(point)] = false;
    }
  }
  return lit;
}

double GroupReader::RelativeFlux(int group, int channel) const {
  double flux = 0;
  double count = 0;
  for (const std::int64_t number : Pictures(group, channel)) {
    if (number < session_.picture_count() && session_.WasTaken(number)) {
      flux += state_.relative_flux[static_cast<std::size_t>(number)];
      count += 1;
    }
  }
  return count > 0 ? flux / count : 1;
}

double GroupReader::EnterFactor(int group, int channel, int i, int j) const {
  return calibration_.RdPerRate(channel, header_.GridPoint(i, j), {0, 0}, header_.eta) /
         RelativeFlux(group, channel);
}

std::size_t GroupReader::MostSpots() const {
  std::size_t most = 0;
  for (int group = 0; group < session_.schedule().group_count(); ++group) {
    most = std::max(most, session_.schedule().Group(group).size());
  }
  return most;
}

void GroupReader::ReadRings(const RateFrame& rates,
                            int group,
                            int channel,
                            std::span<SpotRings> rings) const {
  std::size_t k = 0;
  for (const acquire::GridIndex& point : session_.schedule().Group(group)) {
    const PointMm spot = spots_[static_cast<std::size_t>(
        std::int64_t{point.j} * header_.points_x + point.i)];
    rings[k++] = rings_.Around(rates, channel, spot, rings_.RingMm());
  }
}

void GroupReader::AddPlanes(const SurfaceModel& surface, int thread_count) {
  const calibrate::ColourFilters& filters = calibration_.corrections.filters;
  std::vector<calibrate::MosaicPlane> added;
  for (int channel = 0; channel < std::ssize(header_.channels); ++channel) {
    std::vector<Part> parts;
    for (const calibrate::PlaneShare& share : SharesOf(filters, channel)) {
      const calibrate::MosaicPlane& plane = share.plane;
      const auto known = std::find_if(added.begin(), added.end(), [&](const auto& p) {
        return p.column == plane.column && p.row == plane.row;
      });
      const double sees = filters.mosaic.empty()
                              ? 1
                              : filters.lasers[static_cast<std::size_t>(channel)]
                                              [static_cast<std::size_t>(plane.colour)];
      parts.push_back({static_cast<std::size_t>(known - added.begin()),
                       static_cast<float>(share.weight / sees)});
      if (known == added.end()) {
        added.push_back(plane);
        planes_.emplace_back(calibration_, plane, header_, surface, thread_count);
      }
    }
    parts_.push_back(std::move(parts));
  }
}

// The mean over the planes that see the channel; a cell must be seen by all.
void GroupReader::ReadPlanes(const RateFrame& rates,
                             int group,
                             std::size_t channel,
                             CellValues cells) const {
  const auto spots = session_.schedule().Group(group);
  const std::vector<Part>& parts = parts_[channel];
  if (parts.size() == 1 && parts[0].factor == 1) {
    planes_[parts[0].plane].Read(rates, spots, cells);
    return;
  }
  const std::size_t count = cells.rate.size();
  std::vector<float> rate(count);
  std::vector<float> variance(count);
  std::vector<float> glare(count);
  std::fill(cells.variance.begin(), cells.variance.end(), 0.0F);
  for (const Part& part : parts) {
    std::fill(glare.begin(), glare.end(), 0.0F);
    planes_[part.plane].Read(rates, spots, {rate, variance, glare});
    for (std::size_t k = 0; k < count; ++k) {
      cells.rate[k] += part.factor * rate[k];
      cells.glare[k] += part.factor * glare[k];
      cells.variance[k] =
          variance[k] < 0 || cells.variance[k] < 0
              ? -1.0F
              : cells.variance[k] + part.factor * part.factor * variance[k];
    }
  }
}

GroupPicture GroupReader::Read(int group) const {
  const auto cells = static_cast<std::size_t>(lattice().CellCount());
  const std::size_t channels = header_.channels.size();
  GroupPicture picture;
  picture.rd.assign(channels * cells, 0.0F);
  picture.sigma.assign(channels * cells, -1.0F);
  picture.floor.assign(channels * cells, 0.0F);
  const std::size_t spots = MostSpots();
  picture.rings.resize(channels * spots);
  RateFrame rates;
  std::vector<acquire::Frame> frames;
  for (std::size_t c = 0; c < channels; ++c) {
    frames.clear();
    for (const std::int64_t number : Pictures(group, static_cast<int>(c))) {
      if (session_.WasTaken(number)) {
        frames.push_back(session_.ReadFrame(number));
      }
    }
    picture.frame_count += std::ssize(frames);
    if (frames.empty()) {
      continue;  // an adaptive capture had no use for this channel here
    }
    MergeExposures(frames, calibration_, rates);
    picture.saturated_count += rates.saturated_count;
    const CellValues values{std::span(picture.rd).subspan(c * cells, cells),
                            std::span(picture.sigma).subspan(c * cells, cells),
                            std::span(picture.floor).subspan(c * cells, cells)};
    ReadPlanes(rates, group, c, values);
    ReadRings(rates,
              group,
              static_cast<int>(c),
              std::span(picture.rings).subspan(c * spots, spots));
    ToRd(values);
  }
  return picture;
}

// From rates, variances and glare to R_d, sigma and floor, in place. What is known of
// glare only to so much is common to neighbouring cells: no mean over pixels lessens
// it.
void GroupReader::ToRd(CellValues cells) const {
  for (std::size_t k = 0; k < cells.rate.size(); ++k) {
    const float exit = exit_factor_[k];
    const float unsure = glare_sigma_ * std::max(0.0F, cells.glare[k]);
    const float variance = cells.variance[k];
    cells.rate[k] *= exit;
    cells.variance[k] =
        variance < 0 ? -1.0F : std::sqrt(variance + unsure * unsure) * exit;
    cells.glare[k] = unsure * exit;
  }
}

std::size_t GroupReader::SharedBytes() const {
  std::size_t bytes = rings_.MemoryBytes();
  for (const PlaneReader& plane : planes_) {
    bytes += plane.MemoryBytes();
  }
  return bytes;
}

std::size_t GroupReader::ResultBytes() const {
  return header_.channels.size() * static_cast<std::size_t>(lattice().CellCount()) * 3 *
         sizeof(float);
}

std::size_t GroupReader::WorkingBytes() const {
  const auto pixels = static_cast<std::size_t>(calibration_.camera.width_px) *
                      static_cast<std::size_t>(calibration_.camera.height_px);
  std::size_t most_exposures = 0;
  for (const auto& numbers : pictures_) {
    most_exposures = std::max(most_exposures, numbers.size());
  }
  // Counts, the file that they are read from (as a string that grew), rates and their
  // variances, which pixels are hot, and the glare's pyramid.
  const std::size_t bytes_a_pixel =
      2 * most_exposures + 4 + 2 * sizeof(float) + 1 + sizeof(float);
  return pixels * bytes_a_pixel;
}

}  // namespace nacre::reconstruct::internal
