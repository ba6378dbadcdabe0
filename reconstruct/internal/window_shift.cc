#include "reconstruct/internal/window_shift.h"

#include "calibrate/hysteresis.h"
#include "core/parallel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

namespace nacre::reconstruct::internal {
namespace {

// Cells moved by less than this share of the pitch stay where they are.
constexpr double kNothing = 1e-3;

// Of an edge; its mean is theirs.
constexpr int kPoints = 8;

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

namespace {

// Half the variance of what blurs edges, pixels², along an axis.
double BlurPx2(const calibrate::CameraGeometry& camera,
               const calibrate::SpotProfile& spot) {
  // A pixel's width is a twelfth, bilinear steps are a sixth on the average.
  constexpr double kSteps = 1.0 / 12 + 1.0 / 6;
  const double pixel_mm2 =
      camera.FootprintMm2({0.5 * (camera.width_px - 1), 0.5 * (camera.height_px - 1)});
  const double variance_mm2 = 0.5 * (spot.xx_mm2 + spot.yy_mm2);
  return variance_mm2 > 0 ? 0.5 * (variance_mm2 / pixel_mm2 + kSteps) : 0.0;
}

}  // namespace

class WindowShift::EdgeBuilder {
 public:
  EdgeBuilder(const CellLattice& lattice,
              const calibrate::CameraGeometry& camera,
              const PlaceOnLattice& on_surface,
              double blur_px2)
      : edges(std::int64_t{camera.width_px} * camera.height_px),
        lattice_(lattice),
        camera_(camera),
        on_surface_(on_surface),
        blur_px2_(blur_px2) {}

  // Between two corners of cells, in cells from the lattice's upper left one.
  void Add(PointMm from, PointMm to) {
    edges.Begin();
    std::array<calibrate::PixelPoint, kPoints> points;
    Frame box{camera_.width_px, 0, camera_.height_px, 0};
    for (int k = 0; k < kPoints; ++k) {
      const double t = (k + 0.5) / kPoints;
      const calibrate::PixelPoint at =
          SeenAt(std::lerp(from.x, to.x, t), std::lerp(from.y, to.y, t));
      points[static_cast<std::size_t>(k)] = at;
      const bool is_inside = at.x >= 0 && at.y >= 0 && at.x + 1 < camera_.width_px &&
                             at.y + 1 < camera_.height_px;
      if (!is_inside) {
        return;
      }
      // Four pixels around it, and their neighbours.
      const int x = static_cast<int>(at.x);
      const int y = static_cast<int>(at.y);
      box = {std::min(box.left, std::max(0, x - 1)),
             std::max(box.right, std::min(camera_.width_px - 1, x + 2)),
             std::min(box.top, std::max(0, y - 1)),
             std::max(box.bottom, std::min(camera_.height_px - 1, y + 2))};
    }
    const auto width = static_cast<std::size_t>(std::int64_t{box.right} - box.left + 1);
    weights_.assign(width * static_cast<std::size_t>(box.bottom - box.top + 1), 0.0F);
    for (const calibrate::PixelPoint at : points) {
      AddPoint(at, box);
    }
    for (int y = box.top; y <= box.bottom; ++y) {
      edges.AddRow(std::int64_t{y} * camera_.width_px + box.left,
                   std::span(weights_).subspan(
                       static_cast<std::size_t>(y - box.top) * width, width));
    }
  }

  PixelBoxes edges;

 private:
  struct Frame {
    int left;
    int right;
    int top;
    int bottom;
  };

  calibrate::PixelPoint SeenAt(double column, double row) const {
    const PointMm p{lattice_.corner_mm.x + column * lattice_.pitch_mm,
                    lattice_.corner_mm.y - row * lattice_.pitch_mm};
    return camera_.PixelFromSample(on_surface_ ? on_surface_(p) : p);
  }

  // Bilinear between four pixels, each less its blur: 1 − σ²/2 ∇².
  void AddPoint(calibrate::PixelPoint at, const Frame& box) {
    const int x = static_cast<int>(at.x);
    const int y = static_cast<int>(at.y);
    for (int dy = 0; dy < 2; ++dy) {
      for (int dx = 0; dx < 2; ++dx) {
        const double right = dx == 1 ? at.x - x : x + 1 - at.x;
        const double down = dy == 1 ? at.y - y : y + 1 - at.y;
        const double weight = right * down / kPoints;
        const auto add = [&](int column, int row, double part) {
          const int c = std::clamp(column, box.left, box.right) - box.left;
          const int r = std::clamp(row, box.top, box.bottom) - box.top;
          weights_[static_cast<std::size_t>(
              std::int64_t{r} * (box.right - box.left + 1) + c)] +=
              static_cast<float>(part);
        };
        add(x + dx, y + dy, weight * (1 + 4 * blur_px2_));
        add(x + dx - 1, y + dy, -weight * blur_px2_);
        add(x + dx + 1, y + dy, -weight * blur_px2_);
        add(x + dx, y + dy - 1, -weight * blur_px2_);
        add(x + dx, y + dy + 1, -weight * blur_px2_);
      }
    }
  }

  const CellLattice& lattice_;
  const calibrate::CameraGeometry& camera_;
  const PlaceOnLattice& on_surface_;
  double blur_px2_;
  std::vector<float> weights_;
};

WindowShift::WindowShift(const CellLattice& lattice,
                         const calibrate::CameraGeometry& camera,
                         const RdHeader& header,
                         const SurfaceModel& surface,
                         int thread_count)
    : lattice_(lattice),
      header_(header),
      offsets_(surface.beam_offsets),
      edges_(std::int64_t{camera.width_px} * camera.height_px) {
  double farthest = 0;
  for (PointMm& offset : offsets_) {
    offset = {offset.x / lattice.pitch_mm, -offset.y / lattice.pitch_mm};
    farthest = std::max({farthest, std::abs(offset.x), std::abs(offset.y)});
  }
  if (farthest < kNothing) {
    offsets_.clear();
    return;
  }
  // Rows of upright edges, then rows of those that lie, a builder each.
  std::vector<EdgeBuilder> rows(
      static_cast<std::size_t>(2 * lattice.rows + 1),
      EdgeBuilder(lattice_, camera, surface.on_surface, BlurPx2(camera, surface.spot)));
  ParallelFor(std::ssize(rows), thread_count, [&](std::int64_t n) {
    EdgeBuilder& builder = rows[static_cast<std::size_t>(n)];
    const bool is_upright = n < lattice.rows;
    const auto row = static_cast<double>(is_upright ? n : n - lattice.rows);
    for (int column = 0; column < lattice.columns + (is_upright ? 1 : 0); ++column) {
      const PointMm from{static_cast<double>(column), row};
      builder.Add(from,
                  is_upright ? PointMm{from.x, row + 1} : PointMm{from.x + 1, row});
    }
  });
  for (const EdgeBuilder& row : rows) {
    edges_.Append(row.edges);
  }
  edges_.ShrinkToFit();
}

std::size_t WindowShift::Vertical(int column, int row) const {
  return static_cast<std::size_t>(std::int64_t{row} * (lattice_.columns + 1) + column);
}

std::size_t WindowShift::Horizontal(int column, int row) const {
  return static_cast<std::size_t>(std::int64_t{lattice_.rows} * (lattice_.columns + 1) +
                                  lattice_.Index(column, row));
}

void WindowShift::Apply(const RateFrame& rates,
                        std::span<const acquire::GridIndex> group,
                        std::span<float> means) const {
  if (offsets_.empty()) {
    return;
  }
  const int radius = header_.Radius();
  // The spot that each cell goes with, and how far it is in squared cells.
  struct Nearest {
    const acquire::GridIndex* spot = nullptr;
    int distance2 = 0;
  };
  std::vector<Nearest> nearest(means.size());
  for (const acquire::GridIndex& spot : group) {
    for (int v = 0; v < header_.core; ++v) {
      for (int u = 0; u < header_.core; ++u) {
        const int distance2 = (u - radius) * (u - radius) + (v - radius) * (v - radius);
        Nearest& known =
            nearest[static_cast<std::size_t>(lattice_.Index(spot.i + u, spot.j + v))];
        if (known.spot == nullptr || distance2 < known.distance2) {
          known = {&spot, distance2};
        }
      }
    }
  }
  // Two cells share an edge: each is summed once, when it is asked for.
  constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
  std::vector<float> known(edges_.size(), kUnknown);
  const auto edge = [&](std::size_t n) {
    if (std::isnan(known[n])) {
      known[n] = edges_.Sum(n, rates.rate);
    }
    return known[n];
  };
  for (int row = 0; row < lattice_.rows; ++row) {
    for (int column = 0; column < lattice_.columns; ++column) {
      const auto cell = static_cast<std::size_t>(lattice_.Index(column, row));
      const acquire::GridIndex* spot = nearest[cell].spot;
      if (spot == nullptr) {
        continue;
      }
      const PointMm cells = offsets_[static_cast<std::size_t>(
          std::int64_t{spot->j} * header_.points_x + spot->i)];
      if (std::max(std::abs(cells.x), std::abs(cells.y)) < kNothing) {
        continue;
      }
      means[cell] +=
          static_cast<float>(cells.x) *
              (edge(Vertical(column + 1, row)) - edge(Vertical(column, row))) +
          static_cast<float>(cells.y) *
              (edge(Horizontal(column, row + 1)) - edge(Horizontal(column, row)));
    }
  }
}

}  // namespace nacre::reconstruct::internal
