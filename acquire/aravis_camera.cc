#include "acquire/aravis_camera.h"

#include "acquire/internal/aravis_connection.h"

#include <algorithm>
#include <exception>
#include <future>
#include <thread>

namespace nacre::acquire {
namespace {

using Clock = std::chrono::steady_clock;
using internal::AravisConnection;
using Connection = std::unique_ptr<AravisConnection>;

constexpr std::chrono::milliseconds kFirstPause{250};
constexpr std::chrono::milliseconds kLongestPause{5000};

}  // namespace

std::vector<FoundCamera> FindCameras() {
  arv_update_device_list();
  std::vector<FoundCamera> cameras;
  for (unsigned k = 0; k < arv_get_n_devices(); ++k) {
    const auto text = [k](auto getter) {
      const char* found = getter(k);
      return std::string(found == nullptr ? "" : found);
    };
    cameras.push_back({text(arv_get_device_id),
                       text(arv_get_device_address),
                       text(arv_get_device_protocol),
                       text(arv_get_device_vendor),
                       text(arv_get_device_model),
                       text(arv_get_device_serial_nbr)});
  }
  return cameras;
}

struct AravisCamera::Parts {
  explicit Parts(const AravisOptions& given)
      : options(given),
        connection(std::make_unique<AravisConnection>(options, statistics)),
        info(connection->info()) {}

  // Closing a camera that is gone takes seconds, which go by beside all else.
  void Close() {
    if (!connection) {
      return;
    }
    statistics.missing_packets += connection->StreamCount("n_missing_packets");
    statistics.resent_packets += connection->StreamCount("n_resent_packets");
    if (closing.valid()) {
      closing.get();
    }
    closing = std::async(std::launch::async,
                         [gone = std::move(connection)]() mutable { gone.reset(); });
  }

  void Open() {
    Connection opened = std::make_unique<AravisConnection>(options, statistics);
    const CameraInfo& now = opened->info();
    if (now.model != info.model || now.serial != info.serial ||
        now.width != info.width || now.height != info.height) {
      throw DeviceError(
          fmt::format("camera {}: {} {} of {} x {} pixels answers now, it "
                      "was {} {} of {} x {}",
                      options.id,
                      now.model,
                      now.serial,
                      now.width,
                      now.height,
                      info.model,
                      info.serial,
                      info.width,
                      info.height));
    }
    if (exposure_us) {
      const double restored_us = opened->SetExposureUs(*exposure_us);
      if (restored_us != applied_exposure_us) {
        throw DeviceError(
            fmt::format("camera {}: exposed {} us before it went away and "
                        "{} us now",
                        options.id,
                        applied_exposure_us,
                        restored_us));
      }
    }
    connection = std::move(opened);
  }

  void Tell(bool away) const {
    if (listener) {
      listener(away);
    }
  }

  void Reconnect(const std::string& reason) {
    Tell(/*away=*/true);
    Close();
    const auto deadline =  // NOLINT(clang-analyzer-deadcode.DeadStores): read below
        Clock::now() + std::chrono::duration<double>(options.reconnect_s);
    auto pause = kFirstPause;
    for (;;) {
      std::string message;
      try {
        Open();
        ++statistics.reconnections;
        Tell(/*away=*/false);
        return;
      } catch (const Error& e) {
        message = e.what();
      }
      if (Clock::now() + pause >= deadline) {
        throw DeviceError(fmt::format(
            "{}; tried for {} s to have it back: {}; see to its power and its cable, "
            "then go on with the capture by --resume",
            reason,
            options.reconnect_s,
            message));
      }
      std::this_thread::sleep_for(pause);
      pause = std::min(2 * pause, kLongestPause);
    }
  }

  // After an error: returns once the camera is back if it had gone, else throws.
  void Recover(const Error& e) {
    if (connection->IsConnected()) {
      throw e;
    }
    Reconnect(e.what());
  }

  // A camera that couldn't be had back earlier may be there again.
  void RequireConnection() {
    if (!connection) {
      Reconnect(fmt::format("camera {}: it is gone", options.id));
    }
  }

  const AravisOptions options;
  CameraStatistics statistics;
  Connection connection;
  const CameraInfo info;
  std::optional<double> exposure_us;  // as asked for
  double applied_exposure_us = 0;
  std::function<void(bool)> listener;
  std::future<void> closing;
};

AravisCamera::AravisCamera(const AravisOptions& options)
    : parts_(std::make_unique<Parts>(options)) {}
AravisCamera::~AravisCamera() = default;

CameraInfo AravisCamera::Info() const {
  return parts_->info;
}

double AravisCamera::SetExposureUs(double exposure_us) {
  parts_->RequireConnection();
  const auto set = [&] { return parts_->connection->SetExposureUs(exposure_us); };
  double applied_us = 0;
  try {
    applied_us = set();
  } catch (const Error& e) {
    parts_->Recover(e);
    applied_us = set();
  }
  parts_->exposure_us = exposure_us;
  parts_->applied_exposure_us = applied_us;
  return applied_us;
}

std::optional<Frame> AravisCamera::Capture(std::uint64_t picture_number,
                                           std::chrono::milliseconds timeout) {
  std::optional<PackedFrame> packed = CapturePacked(picture_number, timeout);
  if (!packed) {
    return std::nullopt;
  }
  return std::move(*packed).Unpacked();
}

std::optional<PackedFrame> AravisCamera::CapturePacked(
    std::uint64_t picture_number, std::chrono::milliseconds timeout) {
  parts_->RequireConnection();
  try {
    auto packed = parts_->connection->Capture(picture_number, timeout);
    if (packed) {
      packed->frame.exposure_us = parts_->applied_exposure_us;
    }
    return packed;
  } catch (const Error& e) {
    parts_->Recover(e);
  }
  return std::nullopt;
}

void AravisCamera::OnAway(const std::function<void(bool away)>& listener) {
  parts_->listener = listener;
}

CameraStatistics AravisCamera::Statistics() const {
  CameraStatistics statistics = parts_->statistics;
  if (parts_->connection) {
    statistics.missing_packets += parts_->connection->StreamCount("n_missing_packets");
    statistics.resent_packets += parts_->connection->StreamCount("n_resent_packets");
  }
  return statistics;
}

}  // namespace nacre::acquire
