#include "render/subsurface/window_centre.h"

#include <algorithm>
#include <span>

namespace nacre::render {
namespace {

constexpr int kCells = 5;
constexpr int kNodes = 7;
using Plane = std::array<double, kNodes * kNodes>;

std::size_t NodeIndex(int i, int j) {
  return static_cast<std::size_t>(j * kNodes + i);
}

double HarmonicMean(std::span<const double> values) {
  double sum = 0;
  for (const double v : values) {
    if (v <= 0) {
      return 0;
    }
    sum += 1 / v;
  }
  return static_cast<double>(values.size()) / sum;
}

/// The cells that meet at node (i, j): one at a centre, two or four between cells.
class Meeting {
 public:
  Meeting(const std::array<double, kCells * kCells>& cells, int i, int j) {
    // Node i lies at −1.5 + i/2 pitches: cell (i + 1)/2, or between i/2 and i/2 + 1.
    for (int row = (j + 1) / 2; row <= j / 2 + 1; ++row) {
      for (int column = (i + 1) / 2; column <= i / 2 + 1; ++column) {
        values_[count_++] = cells[static_cast<std::size_t>(row * kCells + column)];
      }
    }
  }
  std::span<const double> values() const { return {values_.data(), count_}; }
  double Mean() const {
    double sum = 0;
    for (const double v : values()) {
      sum += v;
    }
    return sum / static_cast<double>(count_);
  }

 private:
  std::array<double, 4> values_{};
  std::size_t count_ = 0;
};

/// What each of the 3 × 3 cells has to hold. Outside of them, interpolation between
/// cells goes on as usual, and a tent has 1/8 of its weight beyond each border, half a
/// pitch from its centre: so much of the outer cells' light lies outside, and so much
/// of the next ones' inside. The cell in the middle keeps all of its own.
double Share(const std::array<double, kCells * kCells>& cells, int column, int row) {
  const auto along = [](int k, int towards) {
    return towards == k ? (k == 2 ? 1.0 : 0.875)
                        : (k != 2 && towards == 2 * k - 2 ? 0.125 : 0.0);
  };
  double sum = 0;
  for (int y = 0; y < kCells; ++y) {
    for (int x = 0; x < kCells; ++x) {
      sum += along(column, x) * along(row, y) *
             cells[static_cast<std::size_t>(y * kCells + x)];
    }
  }
  return sum;
}

/// Weight of a node in the integral over the 3 × 3 cells, in cell areas.
double Weight(int i, int j) {
  const auto along = [](int k) { return k == 0 || k == kNodes - 1 ? 0.25 : 0.5; };
  return along(i) * along(j);
}

Plane Refine(const std::array<double, kCells * kCells>& cells) {
  Plane nodes{};
  for (int j = 0; j < kNodes; ++j) {
    for (int i = 0; i < kNodes; ++i) {
      const Meeting meeting(cells, i, j);
      const bool rim = i == 0 || j == 0 || i == kNodes - 1 || j == kNodes - 1;
      nodes[NodeIndex(i, j)] = rim ? meeting.Mean() : HarmonicMean(meeting.values());
    }
  }
  double target = 0;
  for (int j = 1; j < kNodes; j += 2) {
    for (int i = 1; i < kNodes; i += 2) {
      const auto at = [&](int x, int y) { return nodes[NodeIndex(i + x, j + y)]; };
      const double corners = at(-1, -1) + at(1, -1) + at(-1, 1) + at(1, 1);
      const double sides = at(0, -1) + at(-1, 0) + at(1, 0) + at(0, 1);
      const double share = Share(cells, (i + 1) / 2, (j + 1) / 2);
      target += share;
      nodes[NodeIndex(i, j)] = std::max(0.0, 4 * share - corners / 4 - sides / 2);
    }
  }
  // What clamping has added is taken from all nodes in proportion.
  double interior = 0;
  double rim = 0;
  for (int j = 0; j < kNodes; ++j) {
    for (int i = 0; i < kNodes; ++i) {
      const bool on_rim = i == 0 || j == 0 || i == kNodes - 1 || j == kNodes - 1;
      (on_rim ? rim : interior) += Weight(i, j) * nodes[NodeIndex(i, j)];
    }
  }
  if (interior > 0 && target > rim) {
    for (int j = 1; j < kNodes - 1; ++j) {
      for (int i = 1; i < kNodes - 1; ++i) {
        nodes[NodeIndex(i, j)] *= (target - rim) / interior;
      }
    }
  }
  return nodes;
}

}  // namespace

WindowCentre::WindowCentre(const Cells& cells) {
  for (std::size_t c = 0; c < 3; ++c) {
    std::array<double, kCells * kCells> plane{};
    for (std::size_t n = 0; n < cells.size(); ++n) {
      plane[n] = static_cast<double>(cells[n].v[c]);
    }
    const Plane nodes = Refine(plane);
    for (std::size_t n = 0; n < nodes.size(); ++n) {
      nodes_[n].v[c] = static_cast<float>(nodes[n]);
    }
  }
}

}  // namespace nacre::render
