#pragma once

#include "rigs/transport/monte_carlo/monte_carlo.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <numbers>
#include <vector>

namespace nacre::rigs::monte_carlo {

enum class Fate : std::uint32_t {
  kAlive,
  kReflected,
  kTransmitted,
  kSides,
  kAbsorbed,
  kBacking,
};
inline constexpr std::size_t kFateCount = 6;

/// How a photon, or a part of one, ended.
struct Ending {
  Fate fate = Fate::kAbsorbed;
  double x_mm = 0;
  double y_mm = 0;
  double depth_mm = 0;
  double cosine = 0;  ///< in air, of the angle it left with
  std::size_t medium = 0;
  bool scattered = false;
};

/// The fraction of the photons that ended in a cell. Each did or didn't, so their
/// number is binomial and its standard error is known photon by photon. A cell that no
/// photon reached is known to one photon, not exactly.
inline Estimate BinomialEstimate(double fraction, std::int64_t photon_count) {
  const auto n = static_cast<double>(photon_count);
  const double some = std::min(std::max(fraction, 1 / n), std::max(1 / n, 1 - 1 / n));
  return {fraction, std::sqrt(some * std::max(1 - some, 1 / n) / n)};
}

/// Sums of integers don't depend on their order.
struct CountCell {
  std::int64_t count = 0;

  void Add(double /*always 1*/) { ++count; }
  void Merge(const CountCell& other) { count += other.count; }
  Estimate Get(std::int64_t photon_count) const {
    return BinomialEstimate(
        static_cast<double>(count) / static_cast<double>(photon_count), photon_count);
  }
};

/// A cell that photons add weights to, each photon once at most: mean and standard
/// error from the photons' first and second moments.
struct MomentCell {
  double sum = 0;
  double sum_of_squares = 0;

  void Add(double weight) {
    sum += weight;
    sum_of_squares += weight * weight;
  }
  void Merge(const MomentCell& other) {
    sum += other.sum;
    sum_of_squares += other.sum_of_squares;
  }
  Estimate Get(std::int64_t photon_count) const {
    const auto n = static_cast<double>(photon_count);
    const double mean = sum / n;
    const double variance = std::max(0.0, sum_of_squares / n - mean * mean);
    return {mean, std::sqrt(variance / std::max(1.0, n - 1))};
  }
};

/// Where endings are counted.
template <class Cell>
class Tally {
 public:
  Tally(const TallyRequest& request, std::size_t medium_count)
      : request_(request),
        medium_(medium_count),
        window_(Square(request.window_core)),
        ring_(static_cast<std::size_t>(request.ring_count)),
        reflected_cosine_(static_cast<std::size_t>(request.cosine_count)),
        transmitted_cosine_(static_cast<std::size_t>(request.cosine_count)),
        depth_(static_cast<std::size_t>(request.depth_count)) {}

  void Add(const Ending& ending, double weight = 1) {
    fate_[static_cast<std::size_t>(ending.fate)].Add(weight);
    switch (ending.fate) {
      case Fate::kReflected:
        AddAtTop(ending, weight);
        AddToBin(reflected_cosine_, ending.cosine * Size(reflected_cosine_), weight);
        break;
      case Fate::kTransmitted:
        if (!ending.scattered) {
          unscattered_.Add(weight);
        }
        AddToBin(
            transmitted_cosine_, ending.cosine * Size(transmitted_cosine_), weight);
        break;
      case Fate::kAbsorbed:
        medium_[ending.medium].Add(weight);
        if (!depth_.empty() &&
            ending.depth_mm < Size(depth_) * request_.depth_step_mm) {
          AddToBin(depth_, ending.depth_mm / request_.depth_step_mm, weight);
        }
        break;
      default:
        break;
    }
  }

  void AddSteps(std::int64_t count) { step_count_ += count; }

  /// All integers of it, to be added to another's of the same request.
  std::vector<std::int64_t> Counts() const {
    std::vector<std::int64_t> counts{step_count_};
    ForEachCell(*this, [&](const Cell& cell) { counts.push_back(cell.count); });
    return counts;
  }
  void SetCounts(const std::vector<std::int64_t>& counts) {
    std::size_t k = 0;
    step_count_ = counts.at(k++);
    ForEachCell(*this, [&](Cell& cell) { cell.count = counts.at(k++); });
  }

  void Merge(const Tally& other) {
    for (std::size_t k = 0; k < kFateCount; ++k) {
      fate_[k].Merge(other.fate_[k]);
    }
    unscattered_.Merge(other.unscattered_);
    MergeTable(medium_, other.medium_);
    MergeTable(window_, other.window_);
    MergeTable(ring_, other.ring_);
    MergeTable(reflected_cosine_, other.reflected_cosine_);
    MergeTable(transmitted_cosine_, other.transmitted_cosine_);
    MergeTable(depth_, other.depth_);
    step_count_ += other.step_count_;
  }

  Result ToResult(std::int64_t photon_count) const {
    const auto total = [&](Fate fate) {
      return fate_[static_cast<std::size_t>(fate)].Get(photon_count);
    };
    Result result;
    result.photon_count = photon_count;
    result.reflected = total(Fate::kReflected);
    result.transmitted = total(Fate::kTransmitted);
    result.sides = total(Fate::kSides);
    result.absorbed = total(Fate::kAbsorbed);
    result.backing = total(Fate::kBacking);
    result.unscattered_transmitted = unscattered_.Get(photon_count);
    result.absorbed_in_medium = Table(medium_, photon_count);
    result.window_per_mm2 = Table(window_, photon_count);
    const double cell_mm2 = request_.window_pitch_mm * request_.window_pitch_mm;
    for (Estimate& cell : result.window_per_mm2) {
      Divide(cell, cell_mm2);
    }
    result.ring_per_mm2 = Table(ring_, photon_count);
    const double width = request_.ring_width_mm;
    for (std::size_t k = 0; k < ring_.size(); ++k) {
      // π ((k + 1)² − k²) width².
      Divide(result.ring_per_mm2[k],
             std::numbers::pi * (2 * static_cast<double>(k) + 1) * width * width);
    }
    result.reflected_in_cosine = Table(reflected_cosine_, photon_count);
    result.transmitted_in_cosine = Table(transmitted_cosine_, photon_count);
    result.absorbed_in_depth = Table(depth_, photon_count);
    result.step_count = step_count_;
    return result;
  }

 private:
  static std::size_t Square(int side) {
    return static_cast<std::size_t>(side) * static_cast<std::size_t>(side);
  }
  static double Size(const std::vector<Cell>& table) {
    return static_cast<double>(table.size());
  }
  static void Divide(Estimate& cell, double area_mm2) {
    cell.mean /= area_mm2;
    cell.se /= area_mm2;
  }

  // position ≥ 0; a cosine of 1 belongs to the last bin.
  static void AddToBin(std::vector<Cell>& table, double position, double weight) {
    if (!table.empty()) {
      table[std::min(static_cast<std::size_t>(position), table.size() - 1)].Add(weight);
    }
  }

  void AddAtTop(const Ending& ending, double weight) {
    const double dx = ending.x_mm - request_.window_centre.x;
    const double dy = ending.y_mm - request_.window_centre.y;
    if (!window_.empty()) {
      const double half = 0.5 * request_.window_core;
      const double u = std::floor(dx / request_.window_pitch_mm + half);
      const double v = std::floor(half - dy / request_.window_pitch_mm);
      if (u >= 0 && v >= 0 && u < request_.window_core && v < request_.window_core) {
        window_[static_cast<std::size_t>(v) *
                    static_cast<std::size_t>(request_.window_core) +
                static_cast<std::size_t>(u)]
            .Add(weight);
      }
    }
    if (!ring_.empty()) {
      const double ring = std::sqrt(dx * dx + dy * dy) / request_.ring_width_mm;
      if (ring < Size(ring_)) {
        ring_[static_cast<std::size_t>(ring)].Add(weight);
      }
    }
  }

  template <class Self, class Use>
  static void ForEachCell(Self& self, Use use) {
    std::for_each(self.fate_.begin(), self.fate_.end(), std::ref(use));
    use(self.unscattered_);
    for (auto* table : {&self.medium_,
                        &self.window_,
                        &self.ring_,
                        &self.reflected_cosine_,
                        &self.transmitted_cosine_,
                        &self.depth_}) {
      std::for_each(table->begin(), table->end(), std::ref(use));
    }
  }

  static void MergeTable(std::vector<Cell>& table, const std::vector<Cell>& other) {
    for (std::size_t k = 0; k < table.size(); ++k) {
      table[k].Merge(other[k]);
    }
  }
  static std::vector<Estimate> Table(const std::vector<Cell>& table,
                                     std::int64_t photon_count) {
    std::vector<Estimate> out;
    out.reserve(table.size());
    for (const Cell& cell : table) {
      out.push_back(cell.Get(photon_count));
    }
    return out;
  }

  TallyRequest request_;
  std::array<Cell, kFateCount> fate_{};
  Cell unscattered_;
  std::vector<Cell> medium_;
  std::vector<Cell> window_;
  std::vector<Cell> ring_;
  std::vector<Cell> reflected_cosine_;
  std::vector<Cell> transmitted_cosine_;
  std::vector<Cell> depth_;
  std::int64_t step_count_ = 0;
};

using CountTally = Tally<CountCell>;
using MomentTally = Tally<MomentCell>;

}  // namespace nacre::rigs::monte_carlo
