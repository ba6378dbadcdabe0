#include "acquire/projector_illuminator.h"

#include "acquire/internal/projector_window.h"
#include "acquire/projector_pattern.h"
#include "core/error.h"

#include <chrono>
#include <condition_variable>
#include <fmt/format.h>
#include <mutex>
#include <optional>
#include <thread>

namespace nacre::acquire {
namespace {

using Clock = std::chrono::steady_clock;
using Picture = std::shared_ptr<const std::vector<std::uint32_t>>;

// Between two looks at what the desktop tells the window.
constexpr std::chrono::milliseconds kPause{20};

}  // namespace

struct ProjectorIlluminator::Parts {
  Parts(const ProjectorOptions& given, std::vector<std::string> its_channels)
      : options(given),
        channels(std::move(its_channels)),
        thread([this](const std::stop_token& stop) { Run(stop); }) {}

  void Run(const std::stop_token& stop) {
    try {
      internal::ProjectorWindow window(options.display);
      {
        const std::lock_guard lock(mutex);
        display_name = window.display_name();
        pattern.emplace(window.width(), window.height(), options);
        black = std::make_shared<const std::vector<std::uint32_t>>(pattern->Black());
        wanted = black;
        ++asked;
      }
      Serve(window, stop);
      window.Show(*black);
    } catch (const Error& e) {
      Fail(e.what());
    }
  }

  void Serve(internal::ProjectorWindow& window, const std::stop_token& stop) {
    using State = internal::ProjectorWindow::State;
    while (!stop.stop_requested()) {
      std::unique_lock lock(mutex);
      woken.wait_for(lock, stop, kPause, [this] { return asked != shown; });
      const Picture picture = wanted;
      const std::int64_t number = asked;
      const bool is_new = number != shown;
      lock.unlock();
      const State state = window.Listen();
      if (state == State::kLost) {
        window.Show(*black);
        throw DeviceError(
            "projector: its window was closed or hidden; leave it as it "
            "is, and resume");
      }
      if (!is_new && state == State::kFine) {
        continue;
      }
      window.Show(*picture);
      lock.lock();
      interruptions += is_new ? 0 : 1;  // something lay over it
      shown = number;
      steady_at =
          Clock::now() +
          std::chrono::microseconds(static_cast<std::int64_t>(options.settle_ms * 1e3));
      changed.notify_all();
    }
  }

  void Fail(const std::string& why) {
    const std::lock_guard lock(mutex);
    failure = why;
    ++interruptions;
    changed.notify_all();
  }

  void Ask(Picture picture) {
    const std::lock_guard lock(mutex);
    wanted = std::move(picture);
    ++asked;
    woken.notify_all();
  }

  void AwaitSteady() {
    std::unique_lock lock(mutex);
    for (;;) {
      changed.wait(lock, [this] { return failure || (shown == asked && shown > 0); });
      if (failure) {
        throw DeviceError(*failure);
      }
      if (Clock::now() >= steady_at) {
        return;
      }
      changed.wait_until(lock, steady_at);
    }
  }

  const ProjectorOptions options;
  const std::vector<std::string> channels;

  mutable std::mutex mutex;  // of all below
  std::condition_variable_any woken;
  std::condition_variable changed;
  std::string display_name;
  std::optional<ProjectorPattern> pattern;
  Picture black;
  Picture wanted;
  std::int64_t asked = 0;  // pictures
  std::int64_t shown = 0;
  std::int64_t interruptions = 0;
  Clock::time_point steady_at;
  std::optional<std::string> failure;
  std::jthread thread;
};

ProjectorIlluminator::ProjectorIlluminator(const ProjectorOptions& options,
                                           std::vector<std::string> channels)
    : parts_(std::make_unique<Parts>(options, std::move(channels))) {
  Expect(options.power.size() == parts_->channels.size(), "a power for each channel");
  parts_->AwaitSteady();
}

ProjectorIlluminator::~ProjectorIlluminator() = default;

IlluminatorInfo ProjectorIlluminator::Info() const {
  return {.model = "video projector",
          .serial = parts_->display_name,
          .channels = parts_->channels,
          .max_angle_rad = parts_->options.max_angle_rad};
}

void ProjectorIlluminator::Light(std::span<const ScanAngle> spots, int channel) {
  Parts& parts = *parts_;
  if (channel < 0 || channel >= static_cast<int>(parts.channels.size())) {
    Blank();
    throw DeviceError(fmt::format("the projector was asked for channel {}; it has {}",
                                  channel,
                                  parts.channels.size()));
  }
  try {
    parts.Ask(std::make_shared<const std::vector<std::uint32_t>>(
        parts.pattern->Draw(spots, channel)));
  } catch (const Error&) {
    Blank();
    throw;
  }
  parts.AwaitSteady();
}

void ProjectorIlluminator::Blank() noexcept {
  parts_->Ask(parts_->black);
}

void ProjectorIlluminator::AwaitSteady() {
  parts_->AwaitSteady();
}

std::int64_t ProjectorIlluminator::Interruptions() const {
  const std::lock_guard lock(parts_->mutex);
  return parts_->interruptions;
}

}  // namespace nacre::acquire
