#include "acquire/laser_safety.h"

#include "core/error.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <map>

namespace nacre::acquire {
namespace {

// Places closer than this are one, so that no jitter by a step passes for a pause.
constexpr int kPlaceSteps = 16;

double LongestStretchUs(const LaserFrame& frame) {
  std::size_t longest = 0;
  std::size_t begin = 0;  // of the lit stretch in one place
  for (std::size_t k = 0; k < frame.points.size(); ++k) {
    const LaserPoint& point = frame.points[k];
    const LaserPoint& first = frame.points[begin];
    if (!point.IsLit()) {
      begin = k + 1;
      continue;
    }
    if (std::abs(point.x - first.x) > kPlaceSteps ||
        std::abs(point.y - first.y) > kPlaceSteps) {
      begin = k;
    }
    longest = std::max(longest, k - begin + 1);
  }
  return static_cast<double>(longest) * 1e6 / frame.points_per_s;
}

// Of the frame's time, in the place that is lit longest. A place is a window of two by
// two cells, wherever it lies, so that a cell's edge halves nothing.
double LargestDuty(const LaserFrame& frame) {
  std::map<std::pair<int, int>, int> lit;  // points a cell
  for (const LaserPoint& point : frame.points) {
    if (point.IsLit()) {
      ++lit[{point.x / kPlaceSteps, point.y / kPlaceSteps}];
    }
  }
  const auto count = [&](int x, int y) {
    const auto cell = lit.find({x, y});
    return cell == lit.end() ? 0 : cell->second;
  };
  int most = 0;
  for (const auto& [cell, points] : lit) {
    for (const int left : {cell.first - 1, cell.first}) {
      for (const int low : {cell.second - 1, cell.second}) {
        most = std::max(most,
                        count(left, low) + count(left + 1, low) + count(left, low + 1) +
                            count(left + 1, low + 1));
      }
    }
  }
  return static_cast<double>(most) / static_cast<double>(frame.points.size());
}

}  // namespace

const char* Name(LaserState state) {
  switch (state) {
    case LaserState::kDisarmed:
      return "disarmed";
    case LaserState::kArmed:
      return "armed";
    case LaserState::kLit:
      return "lit";
    case LaserState::kStopped:
      return "stopped";
  }
  throw LogicError("a laser in no state");
}

LaserSafety::LaserSafety(const LaserLimits& limits)
    : limits_(limits), epoch_(std::make_shared<std::atomic<std::uint64_t>>(0)) {}

// Frames that were checked before are worth nothing any more.
void LaserSafety::Leave(LaserState state) noexcept {
  ++*epoch_;
  state_ = state;
}

void LaserSafety::Arm() {
  if (state_ == LaserState::kStopped) {
    throw DeviceError("the laser can't be armed: emergency stop, " + stop_reason_ +
                      "; clear it once the reason is gone");
  }
  if (state_ == LaserState::kDisarmed) {
    state_ = LaserState::kArmed;
  }
}

void LaserSafety::Disarm() noexcept {
  if (state_ != LaserState::kStopped) {
    Leave(LaserState::kDisarmed);
  }
}

void LaserSafety::EmergencyStop(const std::string& reason) {
  Leave(LaserState::kStopped);
  stop_reason_ = reason;
}

void LaserSafety::ClearEmergencyStop() noexcept {
  if (state_ == LaserState::kStopped) {
    Leave(LaserState::kDisarmed);
  }
}

CheckedFrame LaserSafety::Check(LaserFrame frame, double now_s) {
  const bool dark = std::none_of(frame.points.begin(),
                                 frame.points.end(),
                                 [](const LaserPoint& point) { return point.IsLit(); });
  if (const auto refusal = Refusal(frame, now_s)) {
    const std::string state = Name(state_);
    Disarm();
    throw DeviceError("the laser is " + state + " and refuses a frame: " + *refusal);
  }
  if (dark && state_ == LaserState::kLit) {
    Leave(LaserState::kArmed);
  } else if (!dark && state_ == LaserState::kArmed) {
    state_ = LaserState::kLit;
    lit_since_s_ = now_s;
  }
  return {std::move(frame), dark, epoch_};
}

std::optional<std::string> LaserSafety::Refusal(const LaserFrame& frame,
                                                double now_s) const {
  if (auto refusal = ShapeRefusal(frame)) {
    return refusal;
  }
  bool dark = true;
  for (const LaserPoint& point : frame.points) {
    if (!point.IsLit()) {
      continue;
    }
    dark = false;
    if (auto refusal = PointRefusal(point)) {
      return refusal;
    }
  }
  if (dark) {
    return std::nullopt;
  }
  if (!ShutterMayBeOpen()) {
    return "it holds light";
  }
  if (state_ == LaserState::kLit && !(now_s - lit_since_s_ <= limits_.max_lit_s)) {
    return fmt::format("it has been lit for {:.1f} s, and may be for {} s at a time",
                       now_s - lit_since_s_,
                       limits_.max_lit_s);
  }
  return DwellRefusal(frame);
}

std::optional<std::string> LaserSafety::ShapeRefusal(const LaserFrame& frame) const {
  if (frame.points.empty() || frame.points.size() > std::size_t{kMostPoints} ||
      frame.points_per_s < 7 || frame.points_per_s > 65535) {
    return fmt::format(
        "{} points at {} points/s; a frame has 1 to {} at 7 to 65535 points/s",
        frame.points.size(),
        frame.points_per_s,
        kMostPoints);
  }
  if (frame.Seconds() < kShortestFrameS || frame.Seconds() > kLongestFrameS) {
    return fmt::format("it lasts {:.1f} ms, and must last {} to {} ms",
                       1e3 * frame.Seconds(),
                       1e3 * kShortestFrameS,
                       1e3 * kLongestFrameS);
  }
  if (frame.points.front().IsLit() || frame.points.back().IsLit()) {
    return "it doesn't begin and end dark";
  }
  return std::nullopt;
}

std::optional<std::string> LaserSafety::PointRefusal(const LaserPoint& point) const {
  if (point.x < limits_.x_steps[0] || point.x > limits_.x_steps[1] ||
      point.y < limits_.y_steps[0] || point.y > limits_.y_steps[1]) {
    return fmt::format(
        "light at ({}, {}), outside of the scan field [{}, {}] x [{}, {}]",
        point.x,
        point.y,
        limits_.x_steps[0],
        limits_.x_steps[1],
        limits_.y_steps[0],
        limits_.y_steps[1]);
  }
  const std::uint8_t most =
      *std::max_element(limits_.max_level.begin(), limits_.max_level.end());
  if (point.r > limits_.max_level[0] || point.g > limits_.max_level[1] ||
      point.b > limits_.max_level[2] || point.intensity > most) {
    return fmt::format("levels ({}, {}, {}, {}) above the limit ({}, {}, {}, {})",
                       point.r,
                       point.g,
                       point.b,
                       point.intensity,
                       limits_.max_level[0],
                       limits_.max_level[1],
                       limits_.max_level[2],
                       most);
  }
  return std::nullopt;
}

std::optional<std::string> LaserSafety::DwellRefusal(const LaserFrame& frame) const {
  const double stretch_us = LongestStretchUs(frame);
  if (!(stretch_us <= limits_.max_dwell_us)) {
    return fmt::format("{:.0f} us in one place without a pause, limit {} us",
                       stretch_us,
                       limits_.max_dwell_us);
  }
  const double duty = LargestDuty(frame);
  if (!(duty <= limits_.max_duty)) {
    return fmt::format(
        "one place lit for {:.3f} of the time, limit {}", duty, limits_.max_duty);
  }
  return std::nullopt;
}

}  // namespace nacre::acquire
