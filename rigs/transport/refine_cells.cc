#include "rigs/transport/refine_cells.h"

#include "rigs/internal/gauss_legendre.h"

#include <cmath>
#include <utility>

namespace nacre::rigs {
namespace {

constexpr int kOrder = 3;
constexpr std::size_t kCellNodes = std::size_t{kOrder} * kOrder;  // of a box

struct Box {
  std::size_t cell;
  double x_mm;  // centre, from x_i
  double y_mm;
  double side_mm;
  double part;  // of its cell's area
};

// Means over many boxes at once; box after box, each channel after channel.
std::vector<double> MeansOf(std::span<const Box> boxes,
                            std::size_t channels,
                            const WindowFunction& function) {
  static const internal::GaussRule rule = internal::GaussLegendre(kOrder);
  const std::size_t count = boxes.size() * kCellNodes;
  std::vector<float> x;
  std::vector<float> y;
  x.reserve(count);
  y.reserve(count);
  for (const Box& box : boxes) {
    for (const double v : rule.node) {
      for (const double u : rule.node) {
        x.push_back(static_cast<float>(box.x_mm + 0.5 * box.side_mm * u));
        y.push_back(static_cast<float>(box.y_mm + 0.5 * box.side_mm * v));
      }
    }
  }
  std::vector<float> value(count * channels);
  function({x.data(), y.data(), count}, value.data());
  std::vector<double> means(boxes.size() * channels);
  for (std::size_t b = 0; b < boxes.size(); ++b) {
    for (std::size_t c = 0; c < channels; ++c) {
      double sum = 0;
      for (std::size_t k = 0; k < kCellNodes; ++k) {
        sum += 0.25 * rule.weight[k / kOrder] * rule.weight[k % kOrder] *
               static_cast<double>(value[c * count + b * kCellNodes + k]);
      }
      means[b * channels + c] = sum;
    }
  }
  return means;
}

std::vector<Box> Quarters(std::span<const Box> boxes) {
  std::vector<Box> quarters;
  quarters.reserve(4 * boxes.size());
  for (const Box& box : boxes) {
    const double q = 0.25 * box.side_mm;
    for (const auto& [sx, sy] : {std::pair{-1, -1}, {1, -1}, {-1, 1}, {1, 1}}) {
      quarters.push_back({box.cell,
                          box.x_mm + sx * q,
                          box.y_mm + sy * q,
                          0.5 * box.side_mm,
                          0.25 * box.part});
    }
  }
  return quarters;
}

// A box's means, by channels, to the sums over its cell.
void AddBox(const Box& box,
            std::span<const double> means,
            std::size_t cell_count,
            std::vector<double>& sums) {
  for (std::size_t c = 0; c < means.size(); ++c) {
    sums[c * cell_count + box.cell] += box.part * means[c];
  }
}

}  // namespace

void IntegrateCells(const CellQuadrature& quadrature,
                    std::size_t channels,
                    const WindowFunction& function,
                    std::span<float> means) {
  const std::size_t count = quadrature.weight.size();
  std::vector<float> value(count * channels);
  function({quadrature.dx_mm.data(), quadrature.dy_mm.data(), count}, value.data());
  const std::size_t cells = quadrature.CellCount();
  for (std::size_t c = 0; c < channels; ++c) {
    const float* const of_channel = &value[c * count];
    for (std::size_t cell = 0; cell < cells; ++cell) {
      float sum = 0;
      for (std::size_t k = quadrature.cell_begin[cell];
           k < quadrature.cell_begin[cell + 1];
           ++k) {
        sum += quadrature.weight[k] * of_channel[k];
      }
      means[c * cells + cell] = sum;
    }
  }
}

void RefineCells(const RefineOptions& options,
                 std::span<const std::size_t> cells,
                 std::size_t channels,
                 const WindowFunction& function,
                 std::span<float> means) {
  const auto core = static_cast<std::size_t>(options.core);
  const std::size_t cell_count = core * core;
  const int radius = options.core / 2;
  std::vector<Box> boxes;
  for (const std::size_t cell : cells) {
    boxes.push_back({cell,
                     (static_cast<int>(cell % core) - radius) * options.pitch_mm,
                     (radius - static_cast<int>(cell / core)) * options.pitch_mm,
                     options.pitch_mm,
                     1});
  }
  std::vector<double> sums(cell_count * channels, 0.0);
  std::vector<double> box_means = MeansOf(boxes, channels, function);
  for (int level = 0; level < options.most_levels && !boxes.empty(); ++level) {
    const std::vector<Box> quarters = Quarters(boxes);
    const std::vector<double> quarter_means = MeansOf(quarters, channels, function);
    std::vector<Box> open;
    std::vector<double> open_means;
    for (std::size_t b = 0; b < boxes.size(); ++b) {
      bool agrees = true;
      for (std::size_t c = 0; c < channels; ++c) {
        double finer = 0;
        for (std::size_t q = 0; q < 4; ++q) {
          finer += 0.25 * quarter_means[(4 * b + q) * channels + c];
        }
        const double cell_mean =
            static_cast<double>(means[c * cell_count + boxes[b].cell]);
        const double change = std::abs(finer - box_means[b * channels + c]);
        agrees = agrees && change * boxes[b].part <= options.tolerance * cell_mean;
      }
      const bool is_good = agrees || level + 1 == options.most_levels;
      for (std::size_t q = 0; q < 4; ++q) {
        const Box& quarter = quarters[4 * b + q];
        const auto from =
            quarter_means.begin() + static_cast<std::ptrdiff_t>((4 * b + q) * channels);
        if (is_good) {
          AddBox(quarter, {from, channels}, cell_count, sums);
        } else {
          open.push_back(quarter);
          open_means.insert(
              open_means.end(), from, from + static_cast<std::ptrdiff_t>(channels));
        }
      }
    }
    boxes = std::move(open);
    box_means = std::move(open_means);
  }
  for (const std::size_t cell : cells) {
    for (std::size_t c = 0; c < channels; ++c) {
      means[c * cell_count + cell] = static_cast<float>(sums[c * cell_count + cell]);
    }
  }
}

}  // namespace nacre::rigs
