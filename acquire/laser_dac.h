#pragma once

#include "acquire/laser_safety.h"

namespace nacre::acquire {

/// A device that puts out laser frames, one after the other: while one is put out, a
/// second can wait. All calls throw DeviceError if it is gone or doesn't do as told.
class LaserDac {
 public:
  virtual ~LaserDac() = default;

  /// Whether there is room for the next frame; then the last one sent has begun.
  virtual bool IsReady() = 0;

  /// Requires room. The frame is put out once. A frame that has been invalid since the
  /// laser was disarmed is a LogicError.
  void Send(const CheckedFrame& frame);

  /// Dark at once; what was sent is forgotten.
  virtual void Stop() = 0;

  virtual void SetShutter(bool open) = 0;

 private:
  virtual void Write(const LaserFrame& frame) = 0;
};

}  // namespace nacre::acquire
