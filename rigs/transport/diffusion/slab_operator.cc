#include "rigs/transport/diffusion/slab_operator.h"

#include "core/error.h"

#include <cmath>
#include <cstdint>

namespace nacre::rigs::diffusion {
namespace {

// Through half a cell, then through the surface, per area: J = φ / (h / 2D + 2A).
double SurfaceConductance(double half_layer_mm, double diffusion_mm, double factor) {
  return std::isinf(factor) ? 0 : 1 / (half_layer_mm / diffusion_mm + 2 * factor);
}

// Beyond the side φ falls as exp(−decay · distance): J = φ / (h / 2D + 1 / (D decay)).
double SideConductance(double half_width_mm, double diffusion_mm, double decay_per_mm) {
  return diffusion_mm * decay_per_mm / (1 + half_width_mm * decay_per_mm);
}

}  // namespace

double SlabOperator::Diagonal(std::size_t column, int layer) const {
  const auto k = static_cast<std::size_t>(layer);
  const auto width = static_cast<std::size_t>(nx);
  const double west = column % width == 0 ? 0 : east[column - 1];
  const double south = column < width ? 0 : north[column - width];
  double sum = layer_mm[k] * (absorption[column] + side[column] + east[column] + west +
                              north[column] + south);
  sum += vertical[column] * (inverse_mm[k] + (k == 0 ? 0 : inverse_mm[k - 1]));
  sum += layer == 0 ? top[column] : 0;
  sum += layer == nz - 1 ? bottom[column] : 0;
  return sum;
}

SlabOperator Assemble(const Mesh& mesh,
                      const LateralField& field,
                      const FaceConditions& faces) {
  SlabOperator op;
  op.nx = mesh.x.Count();
  op.ny = mesh.y.Count();
  op.nz = mesh.z.Count();
  for (int k = 0; k < op.nz; ++k) {
    op.layer_mm.push_back(mesh.z.Width(k));
    op.inverse_mm.push_back(
        k + 1 < op.nz ? 1 / (mesh.z.Centre(k + 1) - mesh.z.Centre(k)) : 0);
  }
  const double half_first = 0.5 * mesh.z.Width(0);
  const double half_last = 0.5 * mesh.z.Width(op.nz - 1);
  for (int j = 0; j < op.ny; ++j) {
    for (int i = 0; i < op.nx; ++i) {
      const std::size_t c = op.area_mm2.size();
      const double dx = mesh.x.Width(i);
      const double dy = mesh.y.Width(j);
      const double d = field.diffusion_mm[c];
      Expect(d > 0, "a positive diffusion coefficient");
      op.area_mm2.push_back(dx * dy);
      op.absorption.push_back(field.sigma_a_per_mm[c] * dx * dy);
      op.vertical.push_back(d * dx * dy);
      op.top.push_back(dx * dy * SurfaceConductance(half_first, d, faces.top_factor));
      op.bottom.push_back(dx * dy *
                          SurfaceConductance(half_last, d, faces.bottom_factor));
      op.east.push_back(i + 1 < op.nx ? dy * field.east_diffusion_mm[c] /
                                            (mesh.x.Centre(i + 1) - mesh.x.Centre(i))
                                      : 0);
      op.north.push_back(j + 1 < op.ny ? dx * field.north_diffusion_mm[c] /
                                             (mesh.y.Centre(j + 1) - mesh.y.Centre(j))
                                       : 0);
      double side = 0;
      const double decay = field.side_decay_per_mm[c];
      const int x_sides = (i == 0 ? 1 : 0) + (i + 1 == op.nx ? 1 : 0);
      const int y_sides = (j == 0 ? 1 : 0) + (j + 1 == op.ny ? 1 : 0);
      side += x_sides * dy * SideConductance(0.5 * dx, d, decay);
      side += y_sides * dx * SideConductance(0.5 * dy, d, decay);
      op.side.push_back(side);
    }
  }
  return op;
}

SlabOperator Coarsen(const SlabOperator& fine) {
  SlabOperator coarse;
  coarse.nx = (fine.nx + 1) / 2;
  coarse.ny = (fine.ny + 1) / 2;
  coarse.nz = fine.nz;
  coarse.layer_mm = fine.layer_mm;
  coarse.inverse_mm = fine.inverse_mm;
  const auto columns =
      static_cast<std::size_t>(coarse.nx) * static_cast<std::size_t>(coarse.ny);
  for (auto* values : {&coarse.area_mm2,
                       &coarse.absorption,
                       &coarse.east,
                       &coarse.north,
                       &coarse.side,
                       &coarse.vertical,
                       &coarse.top,
                       &coarse.bottom}) {
    values->assign(columns, 0);
  }
  for (int j = 0; j < fine.ny; ++j) {
    for (int i = 0; i < fine.nx; ++i) {
      const std::size_t f = static_cast<std::size_t>(std::int64_t{j} * fine.nx + i);
      const std::size_t c =
          static_cast<std::size_t>(std::int64_t{j / 2} * coarse.nx + i / 2);
      coarse.area_mm2[c] += fine.area_mm2[f];
      coarse.absorption[c] += fine.absorption[f];
      coarse.side[c] += fine.side[f];
      coarse.vertical[c] += fine.vertical[f];
      coarse.top[c] += fine.top[f];
      coarse.bottom[c] += fine.bottom[f];
      // Only faces between two coarse columns count, and their centres are twice as
      // far apart.
      coarse.east[c] += i % 2 == 1 ? 0.5 * fine.east[f] : 0;
      coarse.north[c] += j % 2 == 1 ? 0.5 * fine.north[f] : 0;
    }
  }
  return coarse;
}

}  // namespace nacre::rigs::diffusion
