#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace nacre::rigs {

/// What a camera twin does at one trigger.
enum class CameraFault {
  kNone,
  kDropPacket,  ///< a packet in the middle of the frame is never sent
  kNoFrame,     ///< the trigger is acknowledged, no frame follows
  kSkipId,      ///< the frame bears the number after next
};

struct GigeCameraTwinOptions {
  int width = 64;  ///< of the sensor; also the region at power-on
  int height = 48;
  std::string serial = "T1";
  /// The count of pixel (x, y) of the sensor after an exposure. Cut to the bit depth.
  std::function<std::uint32_t(int x, int y, double exposure_us)> count =
      [](int x, int y, double) { return static_cast<std::uint32_t>(x + 7 * y); };
  /// Instead of `count`, if not empty: the whole sensor, row by row, for the number
  /// that the driver wrote into the feature UserDefinedValue. Called once a trigger,
  /// never twice at a time.
  std::function<std::vector<std::uint16_t>(std::uint64_t picture_number,
                                           double exposure_us)>
      picture = {};
};

/// A GigE Vision camera that exists only on the loopback interface: answers GVCP
/// (control, UDP port 3956) and sends GVSP (frames), so that a true driver can be run
/// against it. Has an address 127.x.y.z of its own, so that several can be up at once,
/// in several processes too. It is found by broadcast as well.
///
/// Mono8, Mono12, Mono12p, Mono16, BayerRG8, BayerGB12, BayerRG12p, BayerBG16; RGB8,
/// whose counts of pixel x are those of x' = 3x, 3x + 1, 3x + 2. ExposureTime in whole
/// µs in [10, 1e6]; Gain in whole units in [0, 24]; region in steps of 4; software
/// trigger and Line1; DeviceTemperature is 41. Resends nothing.
class GigeCameraTwin {
 public:
  explicit GigeCameraTwin(const GigeCameraTwinOptions& options = {});
  ~GigeCameraTwin();
  GigeCameraTwin(const GigeCameraTwin&) = delete;
  GigeCameraTwin& operator=(const GigeCameraTwin&) = delete;

  const std::string& address() const;

  /// What to do at the next triggers, one each; kNone after these.
  void Script(std::vector<CameraFault> faults);

  /// Falls silent. Plugged in again, it has forgotten all that was set.
  void Unplug();
  void Plug();

  /// Another program takes control: until `Plug` it refuses everybody else.
  void GiveControlAway();

  /// Silent from the next trigger on, and back after `away`, with nothing of its state.
  void UnplugAtNextTrigger(std::chrono::milliseconds away);

  /// A pulse on Line1.
  void PulseLine();

  std::int64_t frames_sent() const;
  /// As set by the driver.
  double gain() const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace nacre::rigs
