#include "acquire/spot_frames.h"

#include "acquire/laser_safety.h"
#include "core/error.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numeric>
#include <optional>

namespace nacre::acquire {
namespace {

// Room for a frame to be late before the one that waits has ended, and short enough for
// two of them to end within 50 ms.
constexpr double kLongestCycleS = 0.020;

// Of all exposures, in points.
std::int64_t CommonPoints(std::span<const double> exposures_us, int points_per_s) {
  std::int64_t common = 0;
  for (const double exposure_us : exposures_us) {
    const double points = exposure_us * points_per_s * 1e-6;
    if (std::abs(points - std::round(points)) > 1e-6 || points < 1) {
      throw DeviceError(fmt::format(
          "an exposure of {} us is {} points at {} points/s, which must be a "
          "whole number",
          exposure_us,
          points,
          points_per_s));
    }
    common = std::gcd(common, std::llround(points));
  }
  return common;
}

// How many cycles make a frame of a good length; none if that can't be.
std::optional<int> CyclesPerFrame(int cycle_points, int points_per_s) {
  for (int cycles = 1; cycles * cycle_points <= LaserSafety::kMostPoints; ++cycles) {
    const double seconds =
        static_cast<double>(cycles * cycle_points) / static_cast<double>(points_per_s);
    if (seconds > LaserSafety::kLongestFrameS) {
      break;
    }
    if (seconds >= LaserSafety::kShortestFrameS &&
        IsGoodPointCount(cycles * cycle_points)) {
      return cycles;
    }
  }
  return std::nullopt;
}

struct Place {
  std::uint16_t x = 0;
  std::uint16_t y = 0;
  friend bool operator==(const Place&, const Place&) = default;
};

std::vector<Place> Places(const ScanField& field, std::span<const ScanAngle> spots) {
  std::vector<Place> places;
  for (const ScanAngle& spot : spots) {
    const Place place{static_cast<std::uint16_t>(field.StepFromAngle(spot.x_rad)),
                      static_cast<std::uint16_t>(field.StepFromAngle(spot.y_rad))};
    if (std::find(places.begin(), places.end(), place) == places.end()) {
      places.push_back(place);
    }
  }
  return places;
}

}  // namespace

bool IsGoodPointCount(int points) {
  return (points - 45) % 64 != 0;
}

SpotTiming PlanSpots(std::span<const double> exposures_us,
                     int most_spots,
                     double settle_us,
                     int points_per_s) {
  Expect(!exposures_us.empty() && most_spots > 0, "exposures and spots");
  const std::int64_t common = CommonPoints(exposures_us, points_per_s);
  SpotTiming timing{
      .points_per_s = points_per_s,
      .slots = most_spots,
      .settle_points =
          std::max(1, static_cast<int>(std::ceil(settle_us * points_per_s * 1e-6)))};
  const auto longest = static_cast<int>(std::min<double>(
      static_cast<double>(common), std::floor(kLongestCycleS * points_per_s)));
  for (int cycle = longest; cycle > most_spots * (timing.settle_points + 1); --cycle) {
    if (common % cycle != 0) {
      continue;
    }
    if (const auto cycles = CyclesPerFrame(cycle, points_per_s)) {
      timing.cycle_points = cycle;
      timing.cycles_per_frame = *cycles;
      timing.dwell_points = (cycle - 1) / most_spots - timing.settle_points;
      return timing;
    }
  }
  const double needed_us =
      1e6 * (most_spots * (timing.settle_points + 1) + 1) / points_per_s;
  throw DeviceError(fmt::format(
      "{} spots a picture, each with {} us to settle, take a cycle of {:.0f} "
      "us or more; the exposures under laser light have {:.0f} us in common, "
      "and a cycle is a whole part of that and at most {:.0f} us. Choose "
      "exposures that are multiples of such a time, fewer spots, or a "
      "shorter time to settle",
      most_spots,
      settle_us,
      needed_us,
      1e6 * static_cast<double>(common) / points_per_s,
      1e6 * kLongestCycleS));
}

LaserFrame MakeSpotFrame(const SpotTiming& timing,
                         const ScanField& field,
                         std::span<const ScanAngle> spots,
                         std::array<std::uint8_t, 3> level) {
  const std::vector<Place> places = Places(field, spots);
  const auto slots = static_cast<std::size_t>(timing.slots);
  Expect(!places.empty() && places.size() <= slots, "a slot for each spot");
  const std::uint8_t intensity = *std::max_element(level.begin(), level.end());
  LaserFrame frame;
  frame.points_per_s = timing.points_per_s;
  const auto cycle_points = static_cast<std::size_t>(timing.cycle_points);
  for (int cycle = 0; cycle < timing.cycles_per_frame; ++cycle) {
    std::size_t next = 0;
    LaserPoint point{.x = places[0].x, .y = places[0].y};
    const std::size_t begin = frame.points.size();
    for (std::size_t slot = 0; slot < slots; ++slot) {
      // Spots are spread over the slots as evenly as may be.
      const bool used = next < places.size() && slot == next * slots / places.size();
      if (used) {
        point = {.x = places[next].x, .y = places[next].y};
        ++next;
      }
      frame.points.insert(
          frame.points.end(), static_cast<std::size_t>(timing.settle_points), point);
      LaserPoint lit = point;
      if (used) {
        lit = {point.x, point.y, level[0], level[1], level[2], intensity};
      }
      frame.points.insert(
          frame.points.end(), static_cast<std::size_t>(timing.dwell_points), lit);
    }
    frame.points.resize(begin + cycle_points, point);
  }
  return frame;
}

LaserFrame MakeDarkFrame(int points_per_s) {
  auto points =
      static_cast<int>(std::ceil(LaserSafety::kShortestFrameS * points_per_s));
  while (!IsGoodPointCount(points)) {
    ++points;
  }
  return {.points_per_s = points_per_s,
          .points = std::vector<LaserPoint>(
              static_cast<std::size_t>(points),
              LaserPoint{.x = ScanField::kLastStep / 2, .y = ScanField::kLastStep / 2}),
          .at_once = true};
}

}  // namespace nacre::acquire
