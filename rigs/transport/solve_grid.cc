#include "rigs/transport/solve_grid.h"

#include "core/error.h"
#include "rigs/transport/diffusion/distinct_points.h"

#include <cstddef>
#include <map>
#include <numeric>
#include <tuple>
#include <utility>
#include <vector>

namespace nacre::rigs {
namespace {

using diffusion::DistinctPoints;
using diffusion::WindowSymmetry;

// An oblique beam isn't its own mirror image, so that only shifts are left: points that
// one and the same motion takes to their distinct point.
DistinctPoints ShiftsOnly(const DistinctPoints& all,
                          const acquire::GridDescription& grid) {
  using Key = std::tuple<std::uint32_t, bool, bool, bool>;
  std::map<Key, std::uint32_t> seen;
  DistinctPoints shifts;
  for (std::size_t k = 0; k < all.of.size(); ++k) {
    const WindowSymmetry& s = all.symmetry[k];
    const Key key{all.of[k], s.transpose, s.mirror_x, s.mirror_y};
    const auto [at, is_new] =
        seen.try_emplace(key, static_cast<std::uint32_t>(shifts.points.size()));
    if (is_new) {
      const auto columns = static_cast<std::size_t>(grid.points_x);
      shifts.points.push_back(
          grid.Point(static_cast<int>(k % columns), static_cast<int>(k / columns)));
    }
    shifts.of.push_back(at->second);
    shifts.symmetry.emplace_back();
  }
  return shifts;
}

DistinctPoints AllDistinct(const acquire::GridDescription& grid) {
  DistinctPoints all;
  for (int j = 0; j < grid.points_y; ++j) {
    for (int i = 0; i < grid.points_x; ++i) {
      all.of.push_back(static_cast<std::uint32_t>(all.points.size()));
      all.points.push_back(grid.Point(i, j));
    }
  }
  all.symmetry.resize(all.points.size());
  return all;
}

// Voxels are beside the pattern and have no symmetry.
DistinctPoints PointsToSolve(const Phantom& phantom) {
  if (phantom.voxels != nullptr) {
    return AllDistinct(phantom.grid);
  }
  DistinctPoints distinct =
      diffusion::FindDistinctPoints(phantom.pattern, phantom.grid);
  return phantom.beam.angle_rad == 0 ? distinct : ShiftsOnly(distinct, phantom.grid);
}

// The grid's points by the distinct point they belong to: those of point d are
// members[first[d]], …, members[first[d + 1] - 1].
struct Classes {
  std::vector<std::uint32_t> first;
  std::vector<std::uint32_t> members;
};

Classes ByClass(const DistinctPoints& distinct) {
  Classes classes;
  classes.first.assign(distinct.points.size() + 1, 0);
  for (const std::uint32_t d : distinct.of) {
    ++classes.first[d + 1];
  }
  std::partial_sum(classes.first.begin(), classes.first.end(), classes.first.begin());
  classes.members.resize(distinct.of.size());
  std::vector<std::uint32_t> next(classes.first.begin(), classes.first.end() - 1);
  for (std::size_t k = 0; k < distinct.of.size(); ++k) {
    classes.members[next[distinct.of[k]]++] = static_cast<std::uint32_t>(k);
  }
  return classes;
}

}  // namespace

GridSummary SolveGrid(const Transport& transport,
                      const std::function<void(int i, int j, Window&& window)>& use,
                      const ProgressFunction& progress) {
  const Phantom& phantom = transport.phantom();
  const acquire::GridDescription& grid = phantom.grid;
  Expect(grid.points_x > 0, "a phantom with a grid");
  const DistinctPoints distinct = PointsToSolve(phantom);
  const Classes classes = ByClass(distinct);
  transport.SolveWindows(
      distinct.points,
      [&](std::size_t d, Window&& window) {
        for (std::uint32_t m = classes.first[d]; m < classes.first[d + 1]; ++m) {
          const std::uint32_t k = classes.members[m];
          const auto columns = static_cast<std::uint32_t>(grid.points_x);
          use(static_cast<int>(k % columns),
              static_cast<int>(k / columns),
              diffusion::Transformed(window, grid.core, distinct.symmetry[k]));
        }
      },
      progress);
  return {.points = static_cast<std::int64_t>(distinct.of.size()),
          .distinct = static_cast<std::int64_t>(distinct.points.size())};
}

}  // namespace nacre::rigs
