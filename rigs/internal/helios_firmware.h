#pragma once

#include "rigs/helios_dac_twin.h"

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace nacre::rigs::internal {

/// What a Helios DAC does with what it is sent. Knows no USB; time is told to it.
class HeliosFirmware {
 public:
  explicit HeliosFirmware(const HeliosDacTwinOptions& options)
      : name_(options.name), firmware_(options.firmware) {}

  /// Power on; the name is kept.
  void Reset(std::int64_t now_ns);

  /// A transfer to the command endpoint; an answer may follow.
  void Command(std::span<const std::uint8_t> bytes, std::int64_t now_ns);
  std::deque<std::vector<std::uint8_t>>& answers() { return answers_; }

  /// Whether a frame would be taken now.
  bool HasRoom(std::int64_t now_ns);
  void Frame(std::span<const std::uint8_t> bytes, std::int64_t now_ns);

  std::shared_ptr<const acquire::LaserFrame> Emitting(std::int64_t now_ns);
  bool IsShutterOpen() const { return shutter_; }
  const std::string& name() const { return name_; }
  const DacCounts& counts() const { return counts_; }
  std::vector<LitSpan> LitSpans(std::int64_t now_ns);

 private:
  struct Output {
    std::shared_ptr<const acquire::LaserFrame> frame;
    bool has_light = false;
    bool loops = false;
    std::int64_t end_ns = 0;
  };
  void Advance(std::int64_t now_ns);
  void Begin(Output output, std::int64_t now_ns);
  void SetLight(std::int64_t now_ns);

  std::string name_;
  std::uint32_t firmware_;
  std::optional<Output> current_;
  std::optional<Output> next_;
  bool shutter_ = false;
  std::int64_t deaf_until_ns_ = 0;
  std::deque<std::vector<std::uint8_t>> answers_;
  DacCounts counts_;
  std::vector<LitSpan> spans_;
  bool lit_ = false;  // the last span is open
};

}  // namespace nacre::rigs::internal
