#include "cli/exchange/profile_fit.h"

#include "cli/exchange/burley.h"
#include "core/error.h"
#include "core/json.h"
#include "core/parallel.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <functional>
#include <numbers>
#include <span>

namespace nacre::exchange {
namespace {

constexpr int kSubcells = 8;    // to a side, of a cell that a ring's border cuts
constexpr double kStep = 1.06;  // between the lengths d that are tabulated

/// Rings one pitch wide out to the windows' edge, and Burley's profile summed over them
/// for all lengths d.
class RingTable {
 public:
  RingTable(int core, double pitch_mm)
      : ring_count_(std::max(1, (core - 1) / 2)), pitch_mm_(pitch_mm) {
    MakeShares(core);
    const double half_mm = (ring_count_ + 0.5) * pitch_mm;
    for (double d = pitch_mm / 20; d < 4 * half_mm; d *= kStep) {
      const std::vector<double> window = BurleyWindow(core, pitch_mm, d);
      d_mm_.push_back(d);
      std::vector<double> within(static_cast<std::size_t>(ring_count_));
      for (const Share& share : shares_) {
        within[share.ring] += share.area * window[share.cell];
      }
      for (std::size_t r = 1; r < within.size(); ++r) {
        within[r] += within[r - 1];
      }
      within_.push_back(std::move(within));
    }
  }

  struct Point {
    double albedo = 0;
    double d_mm = 0;
    double residual = 0;
    double outside = 0;
    bool unlit = false;
    bool at_the_limit = false;
  };

  /// `valid` is null where all cells are.
  Point Fit(const float* rd, const std::uint8_t* valid) const {
    const std::vector<double> within = RingSums(rd, valid);
    const double total = within.back();
    if (!(total > 0)) {
      return {.d_mm = d_mm_.front(), .unlit = true};
    }
    std::size_t best = 0;
    for (std::size_t n = 1; n < d_mm_.size(); ++n) {
      best = Misfit(n, within) < Misfit(best, within) ? n : best;
    }
    Point point;
    point.at_the_limit = best == 0 || best + 1 == d_mm_.size();
    double off = 0;  // of the least misfit, in steps: the vertex of a parabola
    if (!point.at_the_limit) {
      const double below = Misfit(best - 1, within);
      const double above = Misfit(best + 1, within);
      const double bend = below - 2 * Misfit(best, within) + above;
      off = bend > 0 ? std::clamp(0.5 * (below - above) / bend, -0.5, 0.5) : 0;
    }
    const std::size_t next = off < 0 ? best - 1 : std::min(best + 1, d_mm_.size() - 1);
    const double inside =
        std::lerp(within_[best].back(), within_[next].back(), std::abs(off));
    point.d_mm = d_mm_[best] * std::pow(kStep, off);
    point.albedo = total / inside;
    point.outside = 1 - inside;
    point.residual = inside * std::sqrt(Misfit(best, within));
    return point;
  }

 private:
  struct Share {
    std::size_t cell;
    std::size_t ring;
    double area;  ///< of the cell that lies in the ring
  };

  void MakeShares(int core) {
    const int radius = (core - 1) / 2;
    std::vector<int> counts;
    for (int cell = 0; cell < core * core; ++cell) {
      const int column = cell % core;
      const int row = cell / core;
      counts.assign(static_cast<std::size_t>(ring_count_), 0);
      for (int n = 0; n < kSubcells * kSubcells; ++n) {
        const int across = n % kSubcells;
        const int down = n / kSubcells;
        const double x = column - radius + (across + 0.5) / kSubcells - 0.5;
        const double y = radius - row + (down + 0.5) / kSubcells - 0.5;
        // The first ring is a disc of radius 1.5, so that none is all border.
        const int ring = std::max(0, static_cast<int>(std::hypot(x, y) + 0.5) - 1);
        if (ring < ring_count_) {
          ++counts[static_cast<std::size_t>(ring)];
        }
      }
      for (std::size_t ring = 0; ring < counts.size(); ++ring) {
        if (counts[ring] > 0) {
          shares_.push_back({static_cast<std::size_t>(cell),
                             ring,
                             counts[ring] / double{kSubcells * kSubcells}});
        }
      }
    }
  }

  // Light within each radius, per unit of flux.
  std::vector<double> RingSums(const float* rd, const std::uint8_t* valid) const {
    const auto n = static_cast<std::size_t>(ring_count_);
    std::vector<double> sum(n);
    std::vector<double> area(n);
    std::vector<double> whole(n);
    for (const Share& share : shares_) {
      whole[share.ring] += share.area;
      if (valid == nullptr || valid[share.cell] != 0) {
        sum[share.ring] += share.area * static_cast<double>(rd[share.cell]);
        area[share.ring] += share.area;
      }
    }
    double total = 0;
    for (std::size_t r = 0; r < n; ++r) {
      total += area[r] > 0 ? sum[r] * whole[r] / area[r] * pitch_mm_ * pitch_mm_ : 0.0;
      sum[r] = total;
    }
    return sum;
  }

  // Mean square over radii of the difference of shares of what is in all rings.
  double Misfit(std::size_t n, const std::vector<double>& within) const {
    const std::vector<double>& model = within_[n];
    double sum = 0;
    for (std::size_t r = 0; r < within.size(); ++r) {
      const double difference = model[r] / model.back() - within[r] / within.back();
      sum += difference * difference;
    }
    return sum / static_cast<double>(within.size());
  }

  int ring_count_;
  double pitch_mm_;
  std::vector<Share> shares_;
  std::vector<double> d_mm_;
  std::vector<std::vector<double>> within_;  ///< [d][ring]
};

ProfileMaps EmptyMaps(const factor::Material& m) {
  ProfileMaps maps{m.points_x, m.points_y, m.pitch_mm, m.eta, m.channels, {}, {}, {}};
  return maps;
}

ProfileMaps EmptyMaps(const reconstruct::RdHeader& h) {
  ProfileMaps maps{h.points_x, h.points_y, h.pitch_mm, h.eta, h.channels, {}, {}, {}};
  return maps;
}

void Resize(ProfileMaps& maps) {
  const std::size_t size = maps.PixelCount() * maps.channels.size();
  maps.albedo.resize(size);
  maps.d_mm.resize(size);
  maps.residual.resize(size);
}

ProfileFit Collect(ProfileMaps maps, const std::vector<RingTable::Point>& points) {
  ProfileFit fit{std::move(maps), {}};
  Resize(fit.maps);
  ProfileFitSummary& summary = fit.summary;
  for (std::size_t n = 0; n < points.size(); ++n) {
    const RingTable::Point& point = points[n];
    fit.maps.albedo[n] = static_cast<float>(std::min(point.albedo, 1.0));
    fit.maps.d_mm[n] = static_cast<float>(point.d_mm);
    fit.maps.residual[n] = static_cast<float>(point.residual);
    summary.mean_residual += point.residual;
    summary.worst_residual = std::max(summary.worst_residual, point.residual);
    summary.mean_outside += point.outside;
    summary.above_one += point.albedo > 1 ? 1 : 0;
    summary.unlit += point.unlit ? 1 : 0;
    summary.at_the_limit += point.at_the_limit ? 1 : 0;
  }
  summary.mean_residual /= static_cast<double>(points.size());
  summary.mean_outside /= static_cast<double>(points.size());
  return fit;
}

}  // namespace

ProfileFit FitProfiles(const factor::Material& material,
                       int thread_count,
                       const ProgressFunction& progress) {
  const RingTable table(material.core, material.pitch_mm);
  const std::int64_t count = material.PointCount();
  std::vector<RingTable::Point> points(static_cast<std::size_t>(count) *
                                       material.channels.size());
  for (std::size_t c = 0; c < material.channels.size(); ++c) {
    Report(progress,
           {"fit",
            static_cast<std::int64_t>(c),
            static_cast<std::int64_t>(material.channels.size()),
            "profiles"});
    ParallelFor(count, thread_count, [&](std::int64_t p) {
      std::vector<float> window(static_cast<std::size_t>(material.WindowSize()));
      material.EvaluateWindow(static_cast<int>(c),
                              static_cast<int>(p % material.points_x),
                              static_cast<int>(p / material.points_x),
                              window.data());
      points[c * static_cast<std::size_t>(count) + static_cast<std::size_t>(p)] =
          table.Fit(window.data(), nullptr);
    });
  }
  return Collect(EmptyMaps(material), points);
}

ProfileFit FitProfiles(reconstruct::RdReader& reader,
                       int thread_count,
                       const ProgressFunction& progress) {
  const reconstruct::RdHeader& header = reader.header();
  const RingTable table(header.core, header.pitch_mm);
  const auto count = static_cast<std::size_t>(header.PointCount());
  const auto window = static_cast<std::size_t>(header.WindowSize());
  std::vector<RingTable::Point> points(count * header.channels.size());
  for (int j = 0; j < header.points_y; ++j) {
    Report(progress, {"fit", j, header.points_y, "profiles"});
    std::vector<reconstruct::RdSlice> row;
    row.reserve(static_cast<std::size_t>(header.points_x));
    for (int i = 0; i < header.points_x; ++i) {
      row.push_back(reader.ReadSlice(i, j));
    }
    ParallelFor(header.points_x, thread_count, [&](std::int64_t i) {
      const auto at = static_cast<std::size_t>(j * header.points_x + i);
      const reconstruct::RdSlice& slice = row[static_cast<std::size_t>(i)];
      for (std::size_t c = 0; c < header.channels.size(); ++c) {
        points[c * count + at] =
            table.Fit(&slice.rd[c * window], &slice.valid[c * window]);
      }
    });
  }
  return Collect(EmptyMaps(header), points);
}

ExrPart MapPicture(const ProfileMaps& maps,
                   const std::vector<float>& values,
                   double scale) {
  ExrPart part;
  part.width = maps.points_x;
  part.height = maps.points_y;
  part.channels =
      maps.channels.size() == 3
          ? std::vector<std::string>{"R", "G", "B"}
          : (maps.channels.size() == 1 ? std::vector<std::string>{"Y"} : maps.channels);
  part.values = values;
  for (float& value : part.values) {
    value = static_cast<float>(static_cast<double>(value) * scale);
  }
  part.pixels = ExrPixels::kHalf;
  return part;
}

std::string ProfileFitSummary::Brief() const {
  std::string text = fmt::format(
      "light within a radius off by {:.1f} % of A (rms, mean over the sample; worst "
      "{:.1f} %), {:.1f} % of A beyond the windows",
      100 * mean_residual,
      100 * worst_residual,
      100 * mean_outside);
  if (above_one > 0) {
    text += fmt::format("; {} albedos above 1 cut to 1", above_one);
  }
  if (unlit > 0) {
    text += fmt::format("; nothing leaves at {} points", unlit);
  }
  if (at_the_limit > 0) {
    text += fmt::format("; {} lengths at the end of what is searched", at_the_limit);
  }
  return text;
}

Json ProfileFitSummary::ToJson() const {
  return {{"mean_residual", mean_residual},
          {"worst_residual", worst_residual},
          {"mean_outside", mean_outside},
          {"above_one", above_one},
          {"unlit", unlit},
          {"at_the_limit", at_the_limit}};
}

}  // namespace nacre::exchange
