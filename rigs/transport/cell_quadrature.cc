#include "rigs/transport/cell_quadrature.h"

#include "core/error.h"
#include "rigs/internal/gauss_legendre.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>

namespace nacre::rigs {
namespace {

struct Node {
  double x;
  double y;
  double weight;
};
using Nodes = std::vector<Node>;

constexpr std::array kOrders = {1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48};

// A cell away from the peak: a product grid around its centre.
Nodes ProductRule(double x, double y, double pitch_mm, int order) {
  const internal::GaussRule rule = internal::GaussLegendre(order);
  Nodes nodes;
  for (std::size_t b = 0; b < rule.node.size(); ++b) {
    for (std::size_t a = 0; a < rule.node.size(); ++a) {
      nodes.push_back({x + 0.5 * pitch_mm * rule.node[a],
                       y + 0.5 * pitch_mm * rule.node[b],
                       0.25 * rule.weight[a] * rule.weight[b]});
    }
  }
  return nodes;
}

// The central cell: the triangle between the peak and the right edge is
// (s h, s h t), s in [0, 1], t in [−1, 1], with area element h² s ds dt; s = v² draws
// the nodes towards the peak. The other three are quarter turns of it.
Nodes CentralRule(double pitch_mm, int order) {
  const internal::GaussRule rule = internal::GaussLegendre(order);
  const double h = 0.5 * pitch_mm;
  Nodes nodes;
  for (std::size_t b = 0; b < rule.node.size(); ++b) {
    const double v = 0.5 * (1 + rule.node[b]);
    const double s = v * v;
    const double s_ds = s * 2 * v * 0.5 * rule.weight[b];
    for (std::size_t a = 0; a < rule.node.size(); ++a) {
      const double x = s * h;
      const double y = s * h * rule.node[a];
      const double weight = 0.25 * s_ds * rule.weight[a];
      for (const Node& node : {Node{x, y, weight},
                               Node{-y, x, weight},
                               Node{-x, -y, weight},
                               Node{y, -x, weight}}) {
        nodes.push_back(node);
      }
    }
  }
  return nodes;
}

double Mean(const Nodes& nodes, const std::function<double(double)>& profile) {
  double sum = 0;
  for (const Node& node : nodes) {
    sum += node.weight * profile(std::hypot(node.x, node.y));
  }
  return sum;
}

// The coarsest rule that all profiles are content with.
Nodes ChooseRule(int column,
                 int row,
                 const CellQuadratureOptions& options,
                 std::span<const std::function<double(double)>> profiles) {
  const bool is_central = column == 0 && row == 0;
  const auto make = [&](int order) {
    return is_central ? CentralRule(options.pitch_mm, order)
                      : ProductRule(column * options.pitch_mm,
                                    row * options.pitch_mm,
                                    options.pitch_mm,
                                    order);
  };
  Nodes chosen;
  std::vector<double> means;
  for (const int order : kOrders) {
    if (order < options.least_order) {
      continue;
    }
    Nodes finer = make(order);
    std::vector<double> finer_means;
    bool converged = !chosen.empty();
    for (std::size_t p = 0; p < profiles.size(); ++p) {
      finer_means.push_back(Mean(finer, profiles[p]));
      converged = converged && std::abs(finer_means[p] - means[p]) <=
                                   options.tolerance * finer_means[p];
    }
    if (converged) {
      return chosen;
    }
    chosen = std::move(finer);
    means = std::move(finer_means);
  }
  return chosen;  // 48² nodes: as good as single precision
}

}  // namespace

CellQuadrature MakeCellQuadrature(
    const CellQuadratureOptions& options,
    std::span<const std::function<double(double r_mm)>> profiles) {
  Expect(options.core > 0 && options.core % 2 == 1, "an odd core");
  const int radius = options.core / 2;
  // Cells that mirror images of each other share a rule: 0 ≤ row ≤ column.
  std::vector<Nodes> rules;
  for (int column = 0; column <= radius; ++column) {
    for (int row = 0; row <= column; ++row) {
      rules.push_back(ChooseRule(column, row, options, profiles));
    }
  }
  CellQuadrature quadrature;
  quadrature.cell_begin.push_back(0);
  for (int v = radius; v >= -radius; --v) {  // from the top: +y first
    for (int u = -radius; u <= radius; ++u) {
      const int column = std::max(std::abs(u), std::abs(v));
      const int row = std::min(std::abs(u), std::abs(v));
      const auto rule =
          static_cast<std::size_t>(std::int64_t{column} * (column + 1) / 2 + row);
      for (const Node& node : rules[rule]) {
        const double x = std::abs(u) >= std::abs(v) ? node.x : node.y;
        const double y = std::abs(u) >= std::abs(v) ? node.y : node.x;
        quadrature.dx_mm.push_back(static_cast<float>(u < 0 ? -x : x));
        quadrature.dy_mm.push_back(static_cast<float>(v < 0 ? -y : y));
        quadrature.weight.push_back(static_cast<float>(node.weight));
      }
      quadrature.cell_begin.push_back(quadrature.weight.size());
    }
  }
  return quadrature;
}

}  // namespace nacre::rigs
