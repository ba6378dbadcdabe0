#pragma once

#include <filesystem>
#include <sys/types.h>

namespace nacre::acquire {

/// A process of its own that stops a Helios DAC and closes its shutter as soon as this
/// process is dead, whatever it died of. It can't while this process lives: the device
/// is for one program alone, and the system takes it from the dead.
///
/// Signals to this process's group don't reach it.
class LaserWatchdog {
 public:
  /// Returns once it stands by. Throws DeviceError if it can't be started or can't open
  /// the device.
  LaserWatchdog(int usb_bus, int usb_address);
  /// Lets it do its work at once, unless it was released.
  ~LaserWatchdog();
  LaserWatchdog(const LaserWatchdog&) = delete;
  LaserWatchdog& operator=(const LaserWatchdog&) = delete;

  /// False if somebody ended it: then nobody watches.
  bool IsAlive() const;

  /// The laser is off: there is nothing left to watch.
  void Release() noexcept;

  pid_t pid() const { return pid_; }

  /// The program: what the environment's NACRE_LASER_WATCHDOG says, or
  /// nacre-laser-watchdog beside this program or in ../libexec/nacre. Throws
  /// DeviceError if there is none.
  static std::filesystem::path Program();

 private:
  int socket_ = -1;
  pid_t pid_ = -1;
};

/// What that program does: stands by for the DAC at that place of the USB until its
/// standard input ends or process `parent` is dead, then makes the DAC dark. Answers on
/// standard input, a socket. Returns the exit status.
int RunLaserWatchdog(int usb_bus, int usb_address, pid_t parent);

}  // namespace nacre::acquire
