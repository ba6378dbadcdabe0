#include "rigs/emulated_rig.h"

#include "acquire/scan_field.h"
#include "core/error.h"

#include <algorithm>
#include <utility>

namespace nacre::rigs {
namespace {

struct Visit {
  std::uint16_t x = 0;
  std::uint16_t y = 0;
  int channel = 0;
  int points = 0;  // lit
};

// The places that a frame lights, in the order of their first visits.
std::vector<Visit> Visits(const acquire::LaserFrame& frame) {
  std::vector<Visit> visits;
  for (const acquire::LaserPoint& point : frame.points) {
    if (!point.IsLit()) {
      continue;
    }
    const int channel = point.r != 0 ? 0 : point.g != 0 ? 1 : 2;
    const auto visit = std::find_if(visits.begin(), visits.end(), [&](const Visit& v) {
      return v.x == point.x && v.y == point.y && v.channel == channel;
    });
    if (visit == visits.end()) {
      visits.push_back({point.x, point.y, channel, 1});
    } else {
      ++visit->points;
    }
  }
  return visits;
}

}  // namespace

EmulatedRig::EmulatedRig(const std::filesystem::path& rig_toml,
                         std::optional<std::uint64_t> seed)
    : simulated_(rig_toml, {.seed = seed, .thread_count = 1}),
      dac_(std::make_unique<HeliosDacTwin>()) {
  const acquire::CameraInfo info = simulated_.camera().Info();
  GigeCameraTwinOptions options;
  options.width = info.width;
  options.height = info.height;
  options.picture = [this](std::uint64_t number, double exposure_us) {
    return Picture(number, exposure_us);
  };
  camera_ = std::make_unique<GigeCameraTwin>(options);
}

EmulatedRig::~EmulatedRig() {
  camera_.reset();  // its pictures ask for all else
}

void EmulatedRig::Place(acquire::Target target, int pose) {
  const std::lock_guard lock(mutex_);
  simulated_.stage().Place(target, pose);
}

std::int64_t EmulatedRig::uneven_pictures() const {
  const std::lock_guard lock(mutex_);
  return uneven_pictures_;
}

std::vector<std::uint16_t> EmulatedRig::Picture(std::uint64_t number,
                                                double exposure_us) {
  const std::lock_guard lock(mutex_);
  SetLight();
  simulated_.camera().SetExposureUs(exposure_us);
  auto frame = simulated_.camera().Capture(number, std::chrono::milliseconds(0));
  return std::move(frame->counts);
}

void EmulatedRig::SetLight() {
  const auto emitted = dac_->Emitting();
  const std::vector<Visit> visits = emitted ? Visits(*emitted) : std::vector<Visit>();
  for (const Visit& visit : visits) {
    uneven_pictures_ += visit.points != visits.front().points ? 1 : 0;
  }
  if (emitted && shown_ && emitted->points == shown_->points) {
    return;  // so that the camera needn't work the light out again
  }
  shown_ = emitted;
  acquire::Illuminator& laser = simulated_.illuminator();
  if (visits.empty()) {
    laser.Blank();
    return;
  }
  const acquire::ScanField field{laser.Info().max_angle_rad};
  std::vector<acquire::ScanAngle> angles;
  angles.reserve(visits.size());
  for (const Visit& visit : visits) {
    angles.push_back({field.AngleFromStep(visit.x), field.AngleFromStep(visit.y)});
  }
  laser.Light(angles, visits.front().channel);
}

}  // namespace nacre::rigs
