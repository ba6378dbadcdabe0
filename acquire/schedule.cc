#include "acquire/schedule.h"

#include "core/error.h"
#include "core/random.h"

#include <algorithm>
#include <numeric>
#include <set>

namespace nacre::acquire {
namespace {

// The lattice reaches a little beyond the outermost grid points, so that the laser map
// interpolates between spots that were seen, and stays well inside the outermost
// window, which the camera sees anyway.
std::vector<ScanAngle> Lattice(const RigDescription& rig) {
  const GridDescription& grid = rig.grid;
  const double half_x_mm =
      (0.5 * (grid.points_x - 1) + 0.25 * grid.core) * grid.pitch_mm;
  const double half_y_mm =
      (0.5 * (grid.points_y - 1) + 0.25 * grid.core) * grid.pitch_mm;
  const int n = rig.targets.laser_lattice;
  std::vector<ScanAngle> lattice;
  for (int row = 0; row < n; ++row) {
    for (int column = 0; column < n; ++column) {
      lattice.push_back(
          {(2.0 * column / (n - 1) - 1) * half_x_mm / rig.scanner.mm_per_rad,
           (1 - 2.0 * row / (n - 1)) * half_y_mm / rig.scanner.mm_per_rad});
    }
  }
  return lattice;
}

// The order of `count` groups: 0 keeps that of the grid, others shuffle, so that a slow
// drift of the rig doesn't follow the position on the sample.
std::vector<int> Order(int count, std::uint64_t seed) {
  std::vector<int> order(static_cast<std::size_t>(count));
  std::iota(order.begin(), order.end(), 0);
  if (seed != 0) {
    RandomStream random(seed, 0);
    for (std::size_t k = order.size(); k > 1; --k) {
      const auto other =
          static_cast<std::size_t>(random.Uniform() * static_cast<double>(k));
      std::swap(order[k - 1], order[other]);
    }
  }
  return order;
}

}  // namespace

Schedule::Schedule(const RigDescription& rig)
    : grid_(rig.grid), targets_(rig.targets), lattice_(Lattice(rig)) {
  std::set<double> exposures_us(rig.camera.exposures_us.begin(),
                                rig.camera.exposures_us.end());
  exposures_us.insert(rig.camera.flat_exposures_us.begin(),
                      rig.camera.flat_exposures_us.end());
  exposures_us.insert(rig.camera.target_exposure_us);
  exposures_us.insert(rig.targets.reference_exposure_us);
  exposures_us.insert(rig.targets.glare_exposures_us.begin(),
                      rig.targets.glare_exposures_us.end());
  exposures_us_.assign(exposures_us.begin(), exposures_us.end());
  AddTargets(rig);
  AddLaserTargets(rig);
  grid_begin_ = size();
  AddGroups(rig);
}

std::span<const GridIndex> Schedule::Group(int group) const {
  const auto g = static_cast<std::size_t>(group);
  return std::span(points_).subspan(group_begin_[g],
                                    group_begin_[g + 1] - group_begin_[g]);
}

std::vector<ScanAngle> Schedule::Beams(std::int64_t number, const ScanMap* map) const {
  const ScheduledPicture& picture = (*this)[number];
  switch (picture.target) {
    case Target::kNothing:
    case Target::kCheckerboard:
    case Target::kFlat:
    case Target::kAmbient:
      return {};
    case Target::kGlare:
      return {lattice_[lattice_.size() / 2]};
    case Target::kReference:
      return targets_.reverse_lattice && picture.repeat % 2 == 1
                 ? std::vector<ScanAngle>(lattice_.rbegin(), lattice_.rend())
                 : lattice_;
    case Target::kSample:
      break;
  }
  Expect(map != nullptr, "a laser map to aim at the sample with");
  std::vector<ScanAngle> beams;
  for (const GridIndex index : Group(picture.group)) {
    beams.push_back(map->AngleFromSample(grid_.Point(index.i, index.j)));
  }
  if (targets_.patch_mm) {
    beams.push_back(map->AngleFromSample(*targets_.patch_mm));
  }
  return beams;
}

void Schedule::AddTargets(const RigDescription& rig) {
  for (const double exposure_us : exposures_us_) {
    for (int repeat = 0; repeat < rig.camera.dark_frames; ++repeat) {
      pictures_.push_back(
          {.target = Target::kNothing, .repeat = repeat, .exposure_us = exposure_us});
    }
  }
  for (int pose = 0; pose < rig.targets.checkerboard_poses; ++pose) {
    pictures_.push_back({.target = Target::kCheckerboard,
                         .pose = pose,
                         .exposure_us = rig.camera.target_exposure_us});
  }
  for (const double exposure_us : rig.camera.flat_exposures_us) {
    for (int repeat = 0; repeat < 2; ++repeat) {
      pictures_.push_back(
          {.target = Target::kFlat, .repeat = repeat, .exposure_us = exposure_us});
    }
  }
}

void Schedule::AddLaserTargets(const RigDescription& rig) {
  for (int channel = 0; channel < rig.ChannelCount(); ++channel) {
    for (int repeat = 0; repeat < rig.targets.reference_frames; ++repeat) {
      pictures_.push_back({.target = Target::kReference,
                           .channel = channel,
                           .repeat = repeat,
                           .exposure_us = rig.targets.reference_exposure_us});
    }
  }
  for (int channel = 0; channel < rig.ChannelCount(); ++channel) {
    for (const double exposure_us : rig.targets.glare_exposures_us) {
      pictures_.push_back(
          {.target = Target::kGlare, .channel = channel, .exposure_us = exposure_us});
    }
  }
  for (int pose = 0; pose < 2; ++pose) {  // the reference, then the sample
    for (int repeat = 0; repeat < rig.targets.ambient_frames; ++repeat) {
      pictures_.push_back({.target = Target::kAmbient,
                           .pose = pose,
                           .repeat = repeat,
                           .exposure_us = rig.camera.exposures_us.front()});
    }
  }
}

void Schedule::AddGroups(const RigDescription& rig) {
  const GridDescription& grid = rig.grid;
  const int step_x = std::min(rig.schedule.spot_spacing_cells, grid.points_x);
  const int step_y = std::min(rig.schedule.spot_spacing_cells, grid.points_y);
  for (const int lattice : Order(step_x * step_y, rig.schedule.order_seed)) {
    for (int j = lattice / step_x; j < grid.points_y; j += step_y) {
      for (int i = lattice % step_x; i < grid.points_x; i += step_x) {
        if (grid.Includes(i, j)) {
          points_.push_back({i, j});
        }
      }
    }
    if (points_.size() == group_begin_.back()) {
      continue;  // all of them outside of the outline
    }
    const int group = group_count();
    group_begin_.push_back(points_.size());
    for (int channel = 0; channel < rig.ChannelCount(); ++channel) {
      for (const double exposure_us : rig.camera.exposures_us) {
        pictures_.push_back({.target = Target::kSample,
                             .channel = channel,
                             .group = group,
                             .exposure_us = exposure_us});
      }
    }
  }
}

}  // namespace nacre::acquire
