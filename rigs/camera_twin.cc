#include "rigs/camera_twin.h"

#include "core/error.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <utility>

namespace nacre::rigs {
namespace {

constexpr double kMinExposureUs = 1;
constexpr double kMaxExposureUs = 30e6;
constexpr std::int64_t kFramePeriodNs = 50'000'000;

}  // namespace

CameraTwin::CameraTwin(CameraModel model,
                       std::shared_ptr<const Transport> sample,
                       std::shared_ptr<const World> world,
                       int thread_count)
    : model_(std::move(model)),
      world_(std::move(world)),
      thread_count_(thread_count),
      laser_view_(
          model_.geometry, std::move(sample), model_.spot_sigma_mm, thread_count),
      rays_(MapRays(model_.geometry, thread_count)) {
  Expect(model_.spot_flux_mw.size() == model_.electrons_per_us_per_radiance.size(),
         "a sensitivity for each laser channel");
}

acquire::CameraInfo CameraTwin::Info() const {
  return {.model = "nacre camera twin",
          .serial = "1",
          .width = model_.geometry.width_px,
          .height = model_.geometry.height_px,
          .bit_depth = model_.sensor.bit_depth,
          .min_exposure_us = kMinExposureUs,
          .max_exposure_us = kMaxExposureUs};
}

double CameraTwin::SetExposureUs(double exposure_us) {
  if (!(exposure_us >= kMinExposureUs && exposure_us <= kMaxExposureUs)) {
    throw DeviceError(
        fmt::format("the camera was asked for an exposure of {} µs; it can do {} to {}",
                    exposure_us,
                    kMinExposureUs,
                    kMaxExposureUs));
  }
  constexpr double kStepUs = 0.5;  // of the line clock
  exposure_us_ = std::round(exposure_us / kStepUs) * kStepUs;
  return exposure_us_;
}

std::optional<acquire::Frame> CameraTwin::Capture(
    std::uint64_t picture_number, std::chrono::milliseconds /*never late*/) {
  acquire::Frame frame;
  frame.width = model_.geometry.width_px;
  frame.height = model_.geometry.height_px;
  frame.exposure_us = exposure_us_;
  frame.frame_id = picture_number;
  frame.timestamp_ns = static_cast<std::int64_t>(picture_number) * kFramePeriodNs;
  const std::vector<float>& rates = Rates();
  frame.counts.resize(rates.size());
  Expose(model_.sensor,
         {.exposure_us = exposure_us_,
          .seed = model_.seed,
          .picture_number = picture_number},
         rates,
         frame.counts,
         thread_count_);
  return frame;
}

const std::vector<float>& CameraTwin::Rates() {
  if (!has_rates_ || rates_revision_ != world_->revision) {
    ComputeRates(rates_);
    rates_revision_ = world_->revision;
    has_rates_ = true;
  }
  return rates_;
}

void CameraTwin::ComputeRates(std::vector<float>& rates) const {
  using acquire::Target;
  const auto channel = static_cast<std::size_t>(world_->channel);
  const double flux_mw = model_.spot_flux_mw.at(channel);
  double scale = model_.lamp_electrons_per_us;
  switch (world_->target) {
    case Target::kNothing:
      rates.assign(rays_.x.size(), 0.0F);
      return;
    case Target::kFlat:
      rates.assign(rays_.x.size(), static_cast<float>(model_.card_reflectance));
      break;
    case Target::kCheckerboard:
      rates = ViewCheckerboard(
          model_.board,
          rays_,
          model_.geometry.camera_from_sample * BoardPlacement(world_->pose),
          thread_count_);
      break;
    case Target::kReference:
      rates =
          laser_view_.OnReference(world_->spots, flux_mw, model_.reference_reflectance);
      scale = model_.electrons_per_us_per_radiance[channel];
      break;
    case Target::kSample:
      laser_view_.OnSample(world_->spots, flux_mw, channel, rates);
      scale = model_.electrons_per_us_per_radiance[channel];
      break;
  }
  for (float& rate : rates) {
    rate *= static_cast<float>(scale);
  }
}

}  // namespace nacre::rigs
