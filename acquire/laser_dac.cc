#include "acquire/laser_dac.h"

#include "core/error.h"

namespace nacre::acquire {

void LaserDac::Send(const CheckedFrame& frame) {
  Expect(frame.MayBePutOut(), "a frame checked since the laser was armed");
  Write(frame.frame());
}

}  // namespace nacre::acquire
