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

std::vector<float> AmbientMap(const calibrate::Calibration& calibration) {
  const calibrate::SmoothField& ambient = calibration.corrections.ambient;
  return ambient.empty()
             ? std::vector<float>()
             : ambient.Map(calibration.camera.width_px, calibration.camera.height_px);
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

// A beam aimed at x_i arrives elsewhere on a surface that lies higher or lower; the
// lattice goes with the beams. The shift varies too slowly for it to matter at which
// end of it it is taken.
PlaceOnLattice WhereLit(const calibrate::Calibration& calibration,
                        const calibrate::SamplePlane& plane) {
  if (plane.height_mm == 0 && plane.slope_x == 0 && plane.slope_y == 0) {
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
                         double spot_sigma_mm,
                         int thread_count)
    : session_(session),
      calibration_(calibration),
      state_(state),
      header_(header),
      weights_(CellLattice(header),
               calibration.camera,
               spot_sigma_mm,
               thread_count,
               WhereLit(calibration, state.plane)),
      pictures_(FindPictures(session)),
      glare_(calibration.corrections.glare,
             calibration.camera.width_px,
             calibration.camera.height_px),
      ambient_(AmbientMap(calibration)),
      inverse_flat_(InverseFlat(calibration)) {
  const calibrate::Glare& glare = calibration.corrections.glare;
  glare_sigma_ = glare.fraction > 0 ? glare.fraction_sigma / glare.fraction : 0;
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

// What is known of glare only to so much is noise of the pixels it falls on: that is
// the glare's floor.
void GroupReader::Correct(RateFrame& rates) const {
  for (std::size_t k = 0; k < ambient_.size(); ++k) {
    rates.rate[k] -= ambient_[k];
  }
  if (!calibration_.corrections.glare.empty()) {
    const std::vector<float> seen = rates.rate;
    glare_.Remove(rates.rate);
    for (std::size_t k = 0; k < seen.size(); ++k) {
      const float unsure = static_cast<float>(glare_sigma_) * (seen[k] - rates.rate[k]);
      rates.variance[k] +=
          rates.variance[k] < 0 || seen[k] < rates.rate[k] ? 0.0F : unsure * unsure;
    }
  }
  for (std::size_t k = 0; k < inverse_flat_.size(); ++k) {
    rates.rate[k] *= inverse_flat_[k];
    rates.variance[k] *= inverse_flat_[k] * inverse_flat_[k];
  }
}

GroupPicture GroupReader::Read(int group) const {
  const auto cells = static_cast<std::size_t>(lattice().CellCount());
  const std::size_t channels = header_.channels.size();
  GroupPicture picture;
  picture.rd.assign(channels * cells, 0.0F);
  picture.sigma.assign(channels * cells, -1.0F);
  RateFrame rates;
  for (std::size_t c = 0; c < channels; ++c) {
    std::vector<acquire::Frame> frames;
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
    Correct(rates);
    const auto rd = std::span(picture.rd).subspan(c * cells, cells);
    const auto sigma = std::span(picture.sigma).subspan(c * cells, cells);
    weights_.Means(rates, 0, rd, sigma);
    for (std::size_t k = 0; k < cells; ++k) {
      rd[k] *= exit_factor_[k];
      sigma[k] = sigma[k] < 0 ? -1.0F : std::sqrt(sigma[k]) * exit_factor_[k];
    }
  }
  return picture;
}

std::size_t GroupReader::ResultBytes() const {
  return header_.channels.size() * static_cast<std::size_t>(lattice().CellCount()) * 2 *
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
