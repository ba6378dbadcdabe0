#include "render/subsurface/window_profile.h"

#include "render/subsurface/dipole_profile.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace nacre::render {
namespace {

constexpr int kBisections = 28;

/// The x in [low, high] at which the falling function f is `target`.
template <class Falling>
double Solve(double low, double high, double target, const Falling& f) {
  for (int i = 0; i < kBisections; ++i) {
    const double middle = 0.5 * (low + high);
    (f(middle) > target ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

/// The dipole of mean free path 1 that sends back `total` of what entered.
DipoleProfile OfTotal(double total, double reflectance) {
  const auto of_absorption = [&](double a) {
    return DipoleProfile(a, 1 - a, reflectance);
  };
  constexpr double kLeastAbsorbing = 1e-6;
  return of_absorption(Solve(
      kLeastAbsorbing, 1, total, [&](double a) { return of_absorption(a).Total(); }));
}

/// What leaves within a square of side 2h around the beam: the mean over directions of
/// what leaves within the square's border.
double FluxWithinSquare(const RadialProfile& profile, double h) {
  constexpr int kDirections = 8;
  double sum = 0;
  for (int k = 0; k < kDirections; ++k) {
    const double angle = std::numbers::pi / 4 * (k + 0.5) / kDirections;
    sum += profile.FluxWithin(h / std::cos(angle));
  }
  return sum / kDirections;
}

/// Two-point Gauss rules a cell's side is divided into, by how far the cell is.
int RulesAlong(int column, int row) {
  const int away = std::max(std::abs(column), std::abs(row));
  return away == 0 ? 6 : away == 1 ? 4 : away == 2 ? 2 : 1;
}

std::size_t RingOf(int column, int row) {
  return static_cast<std::size_t>(std::lround(std::hypot(column, row)));
}

template <class Visitor>
void ForEachCell(int core, Visitor&& visit) {
  const int radius = core / 2;
  std::size_t n = 0;
  for (int row = -radius; row <= radius; ++row) {
    for (int column = -radius; column <= radius; ++column) {
      visit(n++, column, row);
    }
  }
}

}  // namespace

WindowProfile::WindowProfile(std::span<const ColorLanes> cells,
                             int core,
                             double internal_reflectance)
    : axis_(kSharpest, core + 2), table_(axis_.size()) {
  std::array<double, 3> total{};
  for (const ColorLanes& cell : cells) {
    for (std::size_t c = 0; c < 3; ++c) {
      total[c] += static_cast<double>(cell.v[c]);
    }
  }
  const ColorLanes& middle = cells[cells.size() / 2];
  for (std::size_t c = 0; c < 3; ++c) {
    Start(c, total[c], static_cast<double>(middle.v[c]), internal_reflectance);
  }
  // Rings are corrected linearly from one to the next, so that each bears on others.
  constexpr int kPasses = 4;
  for (int pass = 0; pass < kPasses; ++pass) {
    CorrectRings(cells, core);
  }
}

void WindowProfile::Start(std::size_t channel,
                          double total,
                          double share,
                          double reflectance) {
  if (!(total > 0)) {
    for (ColorLanes& entry : table_) {
      entry.v[channel] = 1;
    }
    return;
  }
  const DipoleProfile unit = OfTotal(total, reflectance);
  constexpr double kBroadest = 8;
  const double z =
      Solve(kSharpest, kBroadest, share / total, [&](double mean_free_path) {
        return FluxWithinSquare(unit, 0.5 / mean_free_path) / unit.Total();
      });
  // Far away a profile may fall below what a float can hold; there the ratio of what
  // was measured to it does all.
  const double least = 1e-9 * unit.Rd(0);
  for (std::uint32_t i = 0; i < table_.size(); ++i) {
    const double x = axis_.Distance(i);
    const double r = std::sqrt(std::max(0.0, x * x - static_cast<double>(kSoft2)));
    table_[i].v[channel] = static_cast<float>(std::max(least, unit.Rd(r / z)));
  }
}

void WindowProfile::CorrectRings(std::span<const ColorLanes> cells, int core) {
  std::vector<ColorLanes> ratio(RingOf(core / 2, core / 2) + 2);
  std::vector<ColorLanes> sum(ratio.size());
  ForEachCell(core, [&](std::size_t n, int column, int row) {
    ratio[RingOf(column, row)] += cells[n];
    sum[RingOf(column, row)] += OfCell(column, row).mean;
  });
  for (std::size_t ring = 0; ring + 1 < ratio.size(); ++ring) {
    for (std::size_t c = 0; c < 3; ++c) {
      ratio[ring].v[c] = sum[ring].v[c] > 0 ? ratio[ring].v[c] / sum[ring].v[c] : 0;
    }
  }
  ratio.back() = ratio[ratio.size() - 2];
  for (std::uint32_t i = 0; i < table_.size(); ++i) {
    const double x = axis_.Distance(i);
    const double r = std::sqrt(std::max(0.0, x * x - static_cast<double>(kSoft2)));
    const auto ring = std::min(static_cast<std::size_t>(r), ratio.size() - 2);
    const auto beyond = static_cast<float>(r - static_cast<double>(ring));
    table_[i] =
        table_[i] * Mix(ratio[ring], ratio[ring + 1], std::clamp(beyond, 0.0F, 1.0F));
  }
}

WindowProfile::Moments WindowProfile::OfCell(int column, int row) const {
  const int rules = RulesAlong(column, row);
  const auto place = [&](int k) {
    const float half = (k % 2 == 0 ? -0.5F : 0.5F) / std::numbers::sqrt3_v<float>;
    const int interval = k / 2;
    return (static_cast<float>(interval) + 0.5F + half) / static_cast<float>(rules) -
           0.5F;
  };
  const auto centre_x = static_cast<float>(column);
  const auto centre_y = static_cast<float>(row);
  Moments moments;
  for (int j = 0; j < 2 * rules; ++j) {
    for (int i = 0; i < 2 * rules; ++i) {
      const float x = place(i);
      const float y = place(j);
      const ColorLanes p =
          At((centre_x + x) * (centre_x + x) + (centre_y + y) * (centre_y + y));
      moments.mean += p;
      moments.column += p * x;
      moments.row += p * y;
    }
  }
  for (std::size_t c = 0; c < 3; ++c) {
    const float sum = moments.mean.v[c];
    moments.column.v[c] = sum > 0 ? moments.column.v[c] / sum : 0;
    moments.row.v[c] = sum > 0 ? moments.row.v[c] / sum : 0;
  }
  moments.mean = moments.mean * (1 / static_cast<float>(4 * rules * rules));
  return moments;
}

}  // namespace nacre::render
