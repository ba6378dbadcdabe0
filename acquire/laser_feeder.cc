#include "acquire/laser_feeder.h"

#include "core/error.h"

#include <algorithm>
#include <fmt/format.h>
#include <utility>

namespace nacre::acquire {
namespace {

constexpr double kFirstPauseS = 0.1;  // between attempts to have a DAC back
constexpr double kLongestPauseS = 2;
constexpr double kPollDarkS = 0.1;  // a DAC that is lost in the dark is missed so soon

}  // namespace

LaserFeeder::LaserFeeder(Settings settings)
    : settings_(std::move(settings)),
      safety_(settings_.limits),
      dac_(settings_.open()) {}

LaserFeeder::~LaserFeeder() {
  Disarm();
}

void LaserFeeder::Arm() {
  safety_.Arm();
  armed_ = true;
  failure_.reset();
  try {
    if (dac_) {
      dac_->SetShutter(true);
    }
  } catch (const Error& e) {
    Lose(e.what());
  }
}

void LaserFeeder::Disarm() noexcept {
  armed_ = false;
  shown_.reset();
  safety_.Disarm();
  CloseShutter();
}

void LaserFeeder::EmergencyStop(const std::string& reason) noexcept {
  armed_ = false;
  shown_.reset();
  safety_.EmergencyStop(reason);
  failure_ = "emergency stop: " + reason;
  CloseShutter();
}

void LaserFeeder::ClearEmergencyStop() noexcept {
  if (safety_.state() == LaserState::kStopped) {
    safety_.ClearEmergencyStop();
    failure_.reset();
  }
}

// Whether or not the one fails, the other is tried.
void LaserFeeder::CloseShutter() noexcept {
  if (!dac_) {
    return;
  }
  std::optional<std::string> trouble;
  for (const bool stop : {true, false}) {
    try {
      if (stop) {
        dac_->Stop();
      } else {
        dac_->SetShutter(false);
      }
    } catch (const Error& e) {
      trouble = e.what();
    }
  }
  dark_sent_ = true;
  if (trouble) {
    Lose(*trouble);
  } else {
    dark_by_s_ = std::min(dark_by_s_, settings_.clock_s());
  }
}

void LaserFeeder::Show(const LaserFrame& frame) {
  if (!armed_) {
    throw DeviceError(fmt::format("the laser is {} and can't be lit; it must be armed",
                                  Name(safety_.state())));
  }
  if (failure_) {  // after all that time it may be there again
    failure_.reset();
    give_up_s_ = settings_.clock_s() + settings_.reconnect_s;
    retry_s_ = settings_.clock_s();
  }
  shown_ = frame;
  shown_->at_once = false;
  sent_ = 0;
}

void LaserFeeder::ShowNothing() noexcept {
  shown_.reset();
  sent_ = 0;
}

bool LaserFeeder::IsSteady() const {
  if (failure_) {
    return false;
  }
  return shown_ ? dac_ != nullptr && sent_ >= 2
                : dark_sent_ && settings_.clock_s() >= dark_by_s_;
}

// Whether the last frame sent may have ended.
bool LaserFeeder::IsLate() const {
  return shown_ && sent_ > 0 && settings_.clock_s() > begins_s_ + shown_->Seconds();
}

std::int64_t LaserFeeder::CountInterruptions() {
  if (IsSteady() && IsLate()) {
    ++interruptions_;
    sent_ = 1;  // until the next frame is known to be in time
  }
  return interruptions_;
}

void LaserFeeder::Step() noexcept {
  try {
    if (!dac_) {
      Reopen();
    }
    if (dac_) {
      Feed();
    }
  } catch (const Error& e) {
    Lose(e.what());
  }
}

// Dark as far as can be, then without it.
void LaserFeeder::Lose(const std::string& reason) noexcept {
  if (shown_) {
    ++interruptions_;
  }
  safety_.Disarm();
  const std::unique_ptr<LaserDac> dac = std::move(dac_);
  if (dac) {
    for (const bool stop : {true, false}) {
      try {
        stop ? dac->Stop() : dac->SetShutter(false);
        dark_by_s_ = std::min(dark_by_s_, settings_.clock_s());
      } catch (const Error&) {
        // It is lost anyway; what it still puts out ends by itself, by dark_by_s_.
      }
    }
  }
  sent_ = 0;
  dark_sent_ = true;
  lost_reason_ = reason;
  const double now_s = settings_.clock_s();
  pause_s_ = kFirstPauseS;
  retry_s_ = now_s + pause_s_;
  give_up_s_ = now_s + settings_.reconnect_s;
}

void LaserFeeder::Reopen() {
  const double now_s = settings_.clock_s();
  if (failure_ || now_s < retry_s_) {
    return;
  }
  std::string message;
  try {
    dac_ = settings_.open();
    if (armed_) {
      safety_.Arm();
      dac_->SetShutter(true);
    }
    return;
  } catch (const Error& e) {
    dac_.reset();
    message = e.what();
  }
  if (now_s >= give_up_s_) {
    failure_ = fmt::format(
        "{}; tried for {} s to have it back: {}; see to its power and its cable, then "
        "go "
        "on with the capture by --resume",
        lost_reason_,
        settings_.reconnect_s,
        message);
    return;
  }
  retry_s_ = std::min(now_s + pause_s_, give_up_s_);
  pause_s_ = std::min(2 * pause_s_, kLongestPauseS);
}

void LaserFeeder::Feed() {
  if (shown_) {
    FeedLit();
  } else if (!dark_sent_) {
    FeedDark();
  } else if (settings_.clock_s() - polled_s_ > kPollDarkS) {
    polled_s_ = settings_.clock_s();
    dac_->IsReady();  // throws if it is gone
  }
}

// False if the frame was refused: then the laser is disarmed and stays so.
bool LaserFeeder::Send(LaserFrame frame) {
  const double seconds = frame.Seconds();
  const bool at_once = frame.at_once;
  std::optional<CheckedFrame> checked;
  try {
    checked = safety_.Check(std::move(frame), settings_.clock_s());
  } catch (const Error& e) {
    Disarm();
    failure_ = e.what();
    return false;
  }
  // At the latest: after what is put out now, which was sent before.
  const double now_s = settings_.clock_s();
  dark_by_s_ = std::max(dark_by_s_, now_s) + seconds;
  dac_->Send(*checked);
  if (at_once) {
    dark_by_s_ = settings_.clock_s() + seconds;
  }
  return true;
}

void LaserFeeder::FeedDark() {
  if (!dac_->IsReady()) {
    return;
  }
  if (Send(settings_.dark)) {
    dark_by_s_ = settings_.clock_s();
    dark_sent_ = true;
  }
}

// A frame begins when the one before it has ended, which is seen only as a change from
// "no room" to "room" between two polls. So of its beginning a time is known that it
// can't be before; the next one must have arrived a frame's length after that, or it
// may have come too late.
void LaserFeeder::FeedLit() {
  const double polled_s = settings_.clock_s();
  if (!dac_->IsReady()) {
    if (sent_ > 0) {
      begins_s_ = std::max(begins_s_, polled_s);
    }
    return;
  }
  const double ready_s = settings_.clock_s();
  const double seconds = shown_->Seconds();
  if (sent_ > 0) {
    begins_s_ = std::min(begins_s_, ready_s);
  }
  const double ends_s = begins_s_ + seconds;
  LaserFrame frame = *shown_;
  frame.at_once = sent_ == 0;
  const double sending_s = settings_.clock_s();
  dark_sent_ = false;
  if (!Send(std::move(frame))) {
    return;
  }
  const double sent_s = settings_.clock_s();
  if (sent_ > 0 && sent_s > ends_s) {
    interruptions_ += sent_ > 1 ? 1 : 0;
    begins_s_ = sending_s;
    sent_ = 1;  // this one began in the dark, or may have
    return;
  }
  begins_s_ = sent_ == 0 ? sending_s : ends_s;
  sent_ = std::min(sent_ + 1, 2);
}

}  // namespace nacre::acquire
