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
      pictures[static_cast<std::size_t>(picture.group * channels + picture.channel)]
          .push_back(number);
    }
  }
  return pictures;
}

std::vector<float> InverseFlat(const calibrate::Calibration& calibration) {
  const calibrate::SmoothField& flat = calibration.corrections.flat_field;
  std::vector<float> inverse;
  if (!flat.empty()) {
    inverse = flat.Map(calibration.camera.width_px, calibration.camera.height_px);
    for (float& value : inverse) {
      value = 1 / value;
    }
  }
  return inverse;
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
      weights_(CellLattice(header),
               calibration.camera,
               spot,
               thread_count,
               {.place = WhereLit(calibration, state.plane),
                .factor = InverseFlat(calibration),
                .with_bins = !calibration.corrections.glare.empty()}),
      shift_(CellLattice(header),
             calibration.camera,
             OnPlane(calibration, state.plane),
             header,
             BeamOffsets(session, calibration, header)),
      pictures_(FindPictures(session)),
      glare_(calibration.corrections.glare,
             calibration.camera.width_px,
             calibration.camera.height_px) {
  const calibrate::Glare& glare = calibration.corrections.glare;
  if (glare.fraction > 0) {
    glare_sigma_ = static_cast<float>(
        std::hypot(glare.fraction_sigma / glare.fraction, GlarePyramid::kError));
  }
  TakeAmbient();
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
  return pictures_[static_cast<std::size_t>(group * session_.rig().ChannelCount() +
                                            channel)];
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

double GroupReader::EnterFactor(int group, int channel, int i, int j) const {
  double flux = 0;
  double count = 0;
  for (const std::int64_t number : Pictures(group, channel)) {
    if (number < session_.picture_count() && session_.WasTaken(number)) {
      flux += state_.relative_flux[static_cast<std::size_t>(number)];
      count += 1;
    }
  }
  return calibration_.RdPerRate(channel, header_.GridPoint(i, j), {0, 0}, header_.eta) *
         (count > 0 ? count / flux : 1);
}

// Ambient light is the same in all pictures: what it is in the cells.
void GroupReader::TakeAmbient() {
  const calibrate::SmoothField& ambient = calibration_.corrections.ambient;
  if (ambient.empty()) {
    return;
  }
  const auto cells = static_cast<std::size_t>(lattice().CellCount());
  RateFrame frame;
  frame.rate = ambient.Map(calibration_.camera.width_px, calibration_.camera.height_px);
  frame.variance.assign(frame.rate.size(), 0.0F);
  std::vector<float> rate(cells);
  std::vector<float> variance(cells);
  std::vector<float> glare(cells, 0.0F);
  TakeGlare(frame, {rate, variance, glare});
  ambient_ = std::move(rate);
  ambient_glare_ = std::move(glare);
}

// Means over cells of a picture less its glare, and the light that was glare.
void GroupReader::TakeGlare(const RateFrame& rates, CellValues cells) const {
  weights_.Means(rates, 0, cells.rate, cells.variance);
  if (glare_.empty()) {
    return;
  }
  BinnedPicture binned(calibration_.camera.width_px, calibration_.camera.height_px);
  binned.Fill(rates.rate, calibration_.camera.width_px);
  weights_.MeansOfBins(glare_.Scattered(std::move(binned)), cells.glare);
  const auto gain = static_cast<float>(1 / (1 - glare_.fraction()));
  for (std::size_t k = 0; k < cells.rate.size(); ++k) {
    cells.rate[k] = cells.rate[k] * gain - cells.glare[k];
    cells.variance[k] *= gain * gain;
  }
}

GroupPicture GroupReader::Read(int group) const {
  const auto cells = static_cast<std::size_t>(lattice().CellCount());
  const std::size_t channels = header_.channels.size();
  GroupPicture picture;
  picture.rd.assign(channels * cells, 0.0F);
  picture.sigma.assign(channels * cells, -1.0F);
  picture.floor.assign(channels * cells, 0.0F);
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
    TakeGlare(rates, values);
    shift_.Apply(rates, session_.schedule().Group(group), values.rate);
    ToRd(values);
  }
  return picture;
}

// From rates, variances and glare to R_d, sigma and floor, in place. What is known of
// glare only to so much is common to neighbouring cells: no mean over pixels lessens
// it.
void GroupReader::ToRd(CellValues cells) const {
  for (std::size_t k = 0; k < ambient_.size(); ++k) {
    cells.rate[k] -= ambient_[k];
    cells.glare[k] -= ambient_glare_[k];
  }
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
  // A frame's file is held beside its counts while it is read.
  return pixels * (2 * (most_exposures + 1) + 2 * sizeof(float));
}

}  // namespace nacre::reconstruct::internal
