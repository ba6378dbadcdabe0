#include "reconstruct/internal/window_shift.h"

#include "calibrate/hysteresis.h"

#include <algorithm>
#include <cmath>

namespace nacre::reconstruct::internal {
namespace {

// Cells moved by less than this share of the pitch stay where they are.
constexpr double kNothing = 1e-3;

// So many cells around a spot R_d bends strongly: edges need all their points there,
// and those without blur.
constexpr int kNear = 2;

std::int64_t FirstPicture(const acquire::SessionReader& session, int group) {
  const acquire::Schedule& schedule = session.schedule();
  for (std::int64_t n = schedule.grid_begin(); n < schedule.size(); ++n) {
    if (schedule[n].group == group && schedule[n].target == acquire::Target::kSample) {
      return n;
    }
  }
  return -1;
}

}  // namespace

std::vector<PointMm> BeamOffsets(const acquire::SessionReader& session,
                                 const calibrate::Calibration& calibration,
                                 const RdHeader& header) {
  const acquire::Schedule& schedule = session.schedule();
  const acquire::ScanMap& map =
      session.manifest().scan_map ? *session.manifest().scan_map : calibration.scan_map;
  std::vector<PointMm> offsets(static_cast<std::size_t>(header.PointCount()));
  for (int group = 0; group < schedule.group_count(); ++group) {
    const std::int64_t number = FirstPicture(session, group);
    if (number < 0) {
      continue;
    }
    // The patch's beam, if there is one, is the last.
    const std::vector<PointMm> beams =
        calibrate::BeamPositions(calibration, schedule.Beams(number, &map));
    const auto points = schedule.Group(group);
    for (std::size_t k = 0; k < std::min(points.size(), beams.size()); ++k) {
      const PointMm x_i = header.GridPoint(points[k].i, points[k].j);
      offsets[static_cast<std::size_t>(std::int64_t{points[k].j} * header.points_x +
                                       points[k].i)] = {beams[k].x - x_i.x,
                                                        beams[k].y - x_i.y};
    }
  }
  return offsets;
}

WindowShift::WindowShift(const CellLattice& lattice,
                         const calibrate::CameraGeometry& camera,
                         const std::function<PointMm(PointMm)>& on_surface,
                         const RdHeader& header,
                         std::vector<PointMm> offsets,
                         const calibrate::SpotProfile& spot)
    : lattice_(lattice),
      header_(header),
      width_px_(camera.width_px),
      height_px_(camera.height_px),
      offsets_(std::move(offsets)) {
  // A pixel's width is a twelfth, bilinear steps are a sixth on the average.
  constexpr double kSteps = 1.0 / 12 + 1.0 / 6;
  const double pixel_mm2 =
      camera.FootprintMm2({0.5 * (camera.width_px - 1), 0.5 * (camera.height_px - 1)});
  const double variance_mm2 = 0.5 * (spot.xx_mm2 + spot.yy_mm2);
  blur_px2_ = variance_mm2 > 0
                  ? static_cast<float>(0.5 * (variance_mm2 / pixel_mm2 + kSteps))
                  : 0.0F;
  double farthest = 0;
  for (PointMm& offset : offsets_) {
    offset = {offset.x / lattice.pitch_mm, -offset.y / lattice.pitch_mm};
    farthest = std::max({farthest, std::abs(offset.x), std::abs(offset.y)});
  }
  if (farthest < kNothing) {
    offsets_.clear();
    return;
  }
  const auto place = [&](double column, double row) {
    const PointMm p{lattice.corner_mm.x + column * lattice.pitch_mm,
                    lattice.corner_mm.y - row * lattice.pitch_mm};
    const calibrate::PixelPoint at =
        camera.PixelFromSample(on_surface ? on_surface(p) : p);
    const double x = std::floor(at.x);
    const double y = std::floor(at.y);
    const bool is_inside =
        x >= 0 && y >= 0 && x + 1 < camera.width_px && y + 1 < camera.height_px;
    return is_inside
               ? Place{static_cast<int>(y) * camera.width_px + static_cast<int>(x),
                       static_cast<float>(at.x - x),
                       static_cast<float>(at.y - y)}
               : Place{};
  };
  for (int row = 0; row < lattice.rows; ++row) {
    for (int column = 0; column <= lattice.columns; ++column) {
      for (int k = 0; k < kPoints; ++k) {
        places_.push_back(place(column, row + (k + 0.5) / kPoints));
      }
    }
  }
  for (int row = 0; row <= lattice.rows; ++row) {
    for (int column = 0; column < lattice.columns; ++column) {
      for (int k = 0; k < kPoints; ++k) {
        places_.push_back(place(column + (k + 0.5) / kPoints, row));
      }
    }
  }
}

std::size_t WindowShift::Vertical(int column, int row) const {
  return static_cast<std::size_t>(std::int64_t{row} * (lattice_.columns + 1) + column);
}

std::size_t WindowShift::Horizontal(int column, int row) const {
  return static_cast<std::size_t>(std::int64_t{lattice_.rows} * (lattice_.columns + 1) +
                                  lattice_.Index(column, row));
}

// A pixel less its blur: 1 − σ²/2 ∇².
float WindowShift::Sharp(const RateFrame& rates, int pixel) const {
  const int x = pixel % width_px_;
  const int y = pixel / width_px_;
  const auto at = [&](int column, int row) {
    return rates
        .rate[static_cast<std::size_t>(std::clamp(row, 0, height_px_ - 1) * width_px_ +
                                       std::clamp(column, 0, width_px_ - 1))];
  };
  const float middle = at(x, y);
  return middle - blur_px2_ * (at(x - 1, y) + at(x + 1, y) + at(x, y - 1) +
                               at(x, y + 1) - 4 * middle);
}

// The mean along an edge; 0 where it isn't seen whole.
float WindowShift::Edge(const RateFrame& rates, std::size_t edge, bool is_near) const {
  const std::size_t step = is_near ? 1 : 2;
  const auto pixel = [&](int at) {
    return is_near ? Sharp(rates, at) : rates.rate[static_cast<std::size_t>(at)];
  };
  float sum = 0;
  for (std::size_t k = step / 2; k < kPoints; k += step) {
    const Place& at = places_[edge * kPoints + k];
    if (at.pixel < 0) {
      return 0;
    }
    const int below = at.pixel + width_px_;
    sum += std::lerp(std::lerp(pixel(at.pixel), pixel(at.pixel + 1), at.right),
                     std::lerp(pixel(below), pixel(below + 1), at.right),
                     at.down);
  }
  return sum * static_cast<float>(step) / kPoints;
}

void WindowShift::Move(const RateFrame& rates,
                       acquire::GridIndex cell,
                       PointMm cells,
                       bool is_near,
                       std::span<float> means) const {
  const float right = Edge(rates, Vertical(cell.i + 1, cell.j), is_near);
  const float left = Edge(rates, Vertical(cell.i, cell.j), is_near);
  const float bottom = Edge(rates, Horizontal(cell.i, cell.j + 1), is_near);
  const float top = Edge(rates, Horizontal(cell.i, cell.j), is_near);
  means[static_cast<std::size_t>(lattice_.Index(cell.i, cell.j))] +=
      static_cast<float>(cells.x) * (right - left) +
      static_cast<float>(cells.y) * (bottom - top);
}

void WindowShift::Apply(const RateFrame& rates,
                        std::span<const acquire::GridIndex> group,
                        std::span<float> means) const {
  if (offsets_.empty()) {
    return;
  }
  const int radius = header_.Radius();
  const auto distance2 = [&](const acquire::GridIndex& spot, int column, int row) {
    const int du = column - spot.i - radius;
    const int dv = row - spot.j - radius;
    return du * du + dv * dv;
  };
  for (const acquire::GridIndex& spot : group) {
    const PointMm cells = offsets_[static_cast<std::size_t>(
        std::int64_t{spot.j} * header_.points_x + spot.i)];
    if (std::max(std::abs(cells.x), std::abs(cells.y)) < kNothing) {
      continue;
    }
    for (int row = spot.j; row < spot.j + header_.core; ++row) {
      for (int column = spot.i; column < spot.i + header_.core; ++column) {
        const int own = distance2(spot, column, row);
        const bool is_nearest = std::none_of(group.begin(), group.end(), [&](auto& s) {
          return distance2(s, column, row) < own;
        });
        if (is_nearest) {
          Move(rates, {column, row}, cells, own <= kNear * kNear, means);
        }
      }
    }
  }
}

}  // namespace nacre::reconstruct::internal
