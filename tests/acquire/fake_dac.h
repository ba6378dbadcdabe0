#pragma once

#include "acquire/laser_dac.h"
#include "core/error.h"

#include <algorithm>
#include <functional>
#include <memory>
#include <optional>
#include <utility>

namespace nacre::testing {

/// A laser projector in virtual time: puts out a frame while a second waits, in a place
/// outside of the program that drives it, whose death it survives.
struct FakeProjector {
  double now_s = 0;
  bool plugged = true;
  bool hangs = false;  ///< no transfer gets through
  bool shutter = false;
  struct Output {
    acquire::LaserFrame frame;
    double begin_s = 0;
    bool has_light = false;
    double end_s() const { return begin_s + frame.Seconds(); }
  };
  std::optional<Output> current;
  std::optional<Output> next;
  double deaf_until_s = 0;
  int writes = 0;
  std::function<void(const acquire::LaserFrame&)> on_light;  ///< as it arrives

  void Advance(double seconds) {
    now_s += seconds;
    while (current && current->end_s() <= now_s) {
      const double end_s = current->end_s();
      current = std::exchange(next, std::nullopt);
      if (current) {
        current->begin_s = end_s;
      }
    }
  }
  void Stop() {
    current.reset();
    next.reset();
    deaf_until_s = now_s + 0.1;
  }
  void Unplug() {
    plugged = false;
    shutter = false;
    Stop();
  }
  /// Whether light comes out at any time of this frame, to be on the safe side.
  bool IsLit() const { return shutter && current && current->has_light; }
};

/// A program's way to it.
class FakeDac final : public acquire::LaserDac {
 public:
  /// `is_dead`: the program is, so that nothing it does has an effect.
  FakeDac(FakeProjector& projector, std::shared_ptr<const bool> is_dead)
      : projector_(projector), is_dead_(std::move(is_dead)) {
    Reach();
  }

  bool IsReady() override {
    Reach();
    return !projector_.next && projector_.now_s >= projector_.deaf_until_s;
  }
  void Stop() override {
    Reach();
    if (!*is_dead_) {
      projector_.Stop();
    }
  }
  void SetShutter(bool open) override {
    Reach();
    if (!*is_dead_) {
      projector_.shutter = open;
    }
  }

 private:
  void Reach() const {
    if (!projector_.plugged || projector_.hangs) {
      throw DeviceError("the projector doesn't answer");
    }
  }
  void Write(const acquire::LaserFrame& frame) override {
    Reach();
    if (*is_dead_) {
      return;
    }
    ++projector_.writes;
    FakeProjector::Output output{
        frame,
        projector_.now_s,
        std::any_of(frame.points.begin(), frame.points.end(), [](const auto& point) {
          return point.IsLit();
        })};
    if (output.has_light && projector_.on_light) {
      projector_.on_light(frame);
    }
    if (!projector_.current || frame.at_once) {
      projector_.current = std::move(output);
    } else {
      projector_.next = std::move(output);
    }
  }

  FakeProjector& projector_;
  std::shared_ptr<const bool> is_dead_;
};

}  // namespace nacre::testing
