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

PinholeCamera OnSurface(PinholeCamera camera, const SamplePose& pose) {
  if (!pose.IsIdeal()) {  // not a bit moves if there is nothing to move
    camera.camera_from_sample = camera.camera_from_sample * pose.SampleFromSurface();
  }
  return camera;
}

bool IsWithin(PointMm point, const PatchModel& patch) {
  return std::hypot(point.x - patch.centre_mm.x, point.y - patch.centre_mm.y) <=
         patch.radius_mm;
}

}  // namespace

CameraTwin::CameraTwin(CameraModel model,
                       const std::shared_ptr<const Transport>& sample,
                       std::shared_ptr<const World> world,
                       int thread_count)
    : model_(std::move(model)),
      world_(std::move(world)),
      thread_count_(thread_count),
      sample_view_(OnSurface(model_.geometry, model_.sample_pose),
                   sample,
                   model_.spot_sigma_mm,
                   thread_count),
      rays_(MapRays(model_.geometry, thread_count)),
      optics_(model_.optics,
              model_.geometry.width_px,
              model_.geometry.height_px,
              thread_count),
      sensor_(model_.sensor,
              model_.geometry.width_px,
              model_.geometry.height_px,
              model_.seed) {
  if (!model_.sample_pose.IsIdeal()) {
    plane_view_.emplace(model_.geometry, sample, model_.spot_sigma_mm, thread_count);
  }
  if (model_.ambient.electrons_per_us > 0) {
    ambient_ = ComputeAmbient();
  }
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
          .max_exposure_us = kMaxExposureUs,
          .mosaic = model_.filters.mosaic};
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
  const double seconds = static_cast<double>(picture_number) * model_.picture_period_s;
  frame.timestamp_ns = static_cast<std::int64_t>(std::llround(seconds * 1e9));
  std::span<const float> rates = Rates(picture_number);
  const bool is_laser = world_->target == acquire::Target::kReference ||
                        world_->target == acquire::Target::kGlare ||
                        world_->target == acquire::Target::kSample;
  const double drift =
      is_laser ? model_.light_noise.drift_per_hour / 3600 * seconds : 0;
  const bool sees_ambient = SeesAmbient();
  if (drift != 0 || sees_ambient) {
    exposed_.assign(rates.begin(), rates.end());
    const bool is_sample =
        world_->target == acquire::Target::kSample ||
        (world_->target == acquire::Target::kAmbient && world_->pose == 1);
    const auto albedo = static_cast<float>(is_sample ? model_.ambient.sample_albedo
                                                     : model_.reference_reflectance);
    const auto power = static_cast<float>(1 + drift);
    for (std::size_t k = 0; k < exposed_.size(); ++k) {
      exposed_[k] = exposed_[k] * power + (sees_ambient ? ambient_[k] * albedo : 0.0F);
    }
    rates = exposed_;
  }
  frame.counts.resize(rates.size());
  sensor_.Expose({.exposure_us = exposure_us_, .picture_number = picture_number},
                 rates,
                 frame.counts,
                 thread_count_);
  return frame;
}

bool CameraTwin::SeesAmbient() const {
  using acquire::Target;
  const Target target = world_->target;
  // Beside the lamp over board and card it is nothing.
  return !ambient_.empty() &&
         (target == Target::kReference || target == Target::kGlare ||
          target == Target::kAmbient || target == Target::kSample);
}

std::vector<float> CameraTwin::ComputeAmbient() const {
  std::vector<float> picture(rays_.x.size());
  for (int y = 0; y < rays_.height; ++y) {
    for (int x = 0; x < rays_.width; ++x) {
      const double u = 2 * (x + 0.5) / rays_.width - 1;
      picture[rays_.Index(x, y)] =
          static_cast<float>(model_.ambient.electrons_per_us *
                             std::max(0.0, 1 + model_.ambient.gradient * u));
    }
  }
  optics_.Apply(picture);
  ApplyFilters(model_.filters.mosaic, model_.filters.white, rays_.width, picture);
  return picture;
}

const std::vector<float>& CameraTwin::Rates(std::uint64_t picture_number) {
  const bool rippled =
      model_.light_noise.ripple > 0 && rates_picture_ != picture_number;
  if (!has_rates_ || rates_revision_ != world_->revision || rippled) {
    ComputeRates(picture_number, rates_);
    rates_revision_ = world_->revision;
    rates_picture_ = picture_number;
    has_rates_ = true;
  }
  return rates_;
}

void CameraTwin::ComputeRates(std::uint64_t picture_number,
                              std::vector<float>& rates) const {
  using acquire::Target;
  const auto channel = static_cast<std::size_t>(world_->channel);
  double scale = model_.lamp_electrons_per_us;
  std::vector<Spot> spots = world_->spots;
  if (model_.light_noise.ripple > 0) {
    AddRipple(model_.light_noise.ripple, model_.seed, picture_number, spots);
  }
  bool is_laser = false;
  switch (world_->target) {
    case Target::kNothing:
    case Target::kAmbient:
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
    case Target::kGlare:
      rates =
          (plane_view_ ? *plane_view_ : sample_view_)
              .OnReference(
                  spots, model_.spot_flux_mw.at(channel), model_.reference_reflectance);
      is_laser = true;
      break;
    case Target::kSample:
      ComputeSampleRates(spots, rates);
      is_laser = true;
      break;
  }
  if (is_laser) {
    scale = model_.electrons_per_us_per_radiance[channel];
  }
  for (float& rate : rates) {
    rate *= static_cast<float>(scale);
  }
  optics_.Apply(rates);
  if (is_laser && model_.light_noise.speckle_contrast > 0) {
    AddSpeckle(model_.light_noise.speckle_contrast, model_.seed, *world_, rates);
  }
  ApplyFilters(model_.filters.mosaic,
               is_laser ? model_.filters.Laser(channel) : model_.filters.white,
               rays_.width,
               rates);
}

void CameraTwin::ComputeSampleRates(const std::vector<Spot>& spots,
                                    std::vector<float>& rates) const {
  const auto channel = static_cast<std::size_t>(world_->channel);
  const double flux_mw = model_.spot_flux_mw.at(channel);
  std::vector<Spot> on_sample;
  std::vector<Spot> on_patch;
  for (Spot spot : spots) {
    if (model_.patch && IsWithin(spot.centre_mm, *model_.patch)) {
      on_patch.push_back(spot);
    } else {
      if (!model_.sample_pose.IsIdeal()) {
        spot.centre_mm = spot.on_sample_mm;
      }
      on_sample.push_back(spot);
    }
  }
  sample_view_.OnSample(on_sample, flux_mw, channel, rates);
  if (model_.specular_reflectance > 0) {
    const std::vector<float> gloss =
        sample_view_.OnReference(on_sample, flux_mw, model_.specular_reflectance);
    for (std::size_t k = 0; k < rates.size(); ++k) {
      rates[k] += gloss[k];
    }
  }
  if (model_.patch) {
    const LaserView& view = plane_view_ ? *plane_view_ : sample_view_;
    const std::vector<float> lit =
        view.OnReference(on_patch, flux_mw, model_.patch->reflectance);
    for (std::size_t k = 0; k < rates.size(); ++k) {
      const PointMm point = {static_cast<double>(view.map().x[k]),
                             static_cast<double>(view.map().y[k])};
      if (IsWithin(point, *model_.patch)) {
        rates[k] = lit[k];
      }
    }
  }
}

}  // namespace nacre::rigs
