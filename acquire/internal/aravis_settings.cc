#include "acquire/internal/aravis_settings.h"

#include <cmath>
#include <functional>

namespace nacre::acquire::internal {
namespace {

using NameLister = std::function<const char**(guint*, GError**)>;

std::string Names(const NameLister& list) {
  GErrorSlot error;
  guint count = 0;
  const std::unique_ptr<const char*, Free> names(list(&count, error.out()));
  std::string text;
  for (guint k = 0; names && k < count; ++k) {
    text += fmt::format("{}{}", k == 0 ? "" : ", ", names.get()[k]);
  }
  return text.empty() ? "none" : text;
}

void SetPixelFormat(ArvCamera* camera, const AravisOptions& options) {
  const PixelFormat& format = WantedFormat(options);
  GErrorSlot error;
  arv_camera_set_pixel_format_from_string(camera, format.name.c_str(), error.out());
  const ArvPixelFormat set =
      error.failed() ? 0 : arv_camera_get_pixel_format(camera, error.out());
  if (set != format.code) {
    throw DeviceError(fmt::format(
        "camera {}: it doesn't take the pixel format {}; it has {}; Nacre reads {}",
        options.id,
        format.name,
        Names([&](guint* count, GError** out) {
          return arv_camera_dup_available_pixel_formats_as_strings(camera, count, out);
        }),
        PixelFormatNames()));
  }
}

void SetRegion(ArvCamera* camera, const AravisOptions& options) {
  if (!options.region) {
    return;
  }
  const SensorRegion& wanted = *options.region;
  GErrorSlot error;
  // From the corner, so that no order of the four writes leaves the sensor in between.
  arv_camera_set_region(camera, 0, 0, wanted.width, wanted.height, error.out());
  error.Check(options.id, "set the size of its region");
  if (wanted.x != 0 || wanted.y != 0) {
    arv_camera_set_region(
        camera, wanted.x, wanted.y, wanted.width, wanted.height, error.out());
    error.Check(options.id, "set the place of its region");
  }
  SensorRegion set;
  arv_camera_get_region(camera, &set.x, &set.y, &set.width, &set.height, error.out());
  error.Check(options.id, "read its region");
  if (set.x != wanted.x || set.y != wanted.y || set.width != wanted.width ||
      set.height != wanted.height) {
    throw DeviceError(fmt::format(
        "camera {}: asked for the region [{}, {}, {}, {}] it takes [{}, {}, {}, {}]; "
        "write what it takes",
        options.id,
        wanted.x,
        wanted.y,
        wanted.width,
        wanted.height,
        set.x,
        set.y,
        set.width,
        set.height));
  }
}

void SwitchOffAutomatics(ArvCamera* camera, const std::string& name) {
  GErrorSlot error;
  if (arv_camera_is_exposure_auto_available(camera, error.out())) {
    arv_camera_set_exposure_time_auto(camera, ARV_AUTO_OFF, error.out());
  }
  error.Check(name, "switch automatic exposure off");
  if (arv_camera_is_gain_auto_available(camera, error.out())) {
    arv_camera_set_gain_auto(camera, ARV_AUTO_OFF, error.out());
  }
  error.Check(name, "switch automatic gain off");
}

void SetGain(ArvCamera* camera, const AravisOptions& options) {
  if (!options.gain) {
    return;
  }
  GErrorSlot error;
  double min = 0;
  double max = 0;
  arv_camera_get_gain_bounds(camera, &min, &max, error.out());
  error.Check(options.id, "read the range of its gain");
  if (*options.gain < min || *options.gain > max) {
    throw DeviceError(fmt::format("camera {}: a gain of {} is outside of its [{}, {}]",
                                  options.id,
                                  *options.gain,
                                  min,
                                  max));
  }
  arv_camera_set_gain(camera, *options.gain, error.out());
  error.Check(options.id, "set its gain");
  const double set = arv_camera_get_gain(camera, error.out());
  error.Check(options.id, "read its gain");
  // Cameras keep gains in steps of a tenth of a decibel or finer.
  if (std::abs(set - *options.gain) > 0.1) {
    throw DeviceError(
        fmt::format("camera {}: asked for a gain of {} it takes {}; write "
                    "what it takes",
                    options.id,
                    *options.gain,
                    set));
  }
}

void SetTrigger(ArvCamera* camera, const AravisOptions& options) {
  GErrorSlot error;
  arv_camera_set_acquisition_mode(camera, ARV_ACQUISITION_MODE_CONTINUOUS, error.out());
  error.Check(options.id, "set continuous acquisition");
  arv_camera_set_trigger(camera, options.trigger.c_str(), error.out());
  const std::string refused = error.message();
  const char* set =
      error.failed() ? nullptr : arv_camera_get_trigger_source(camera, error.out());
  if (set == nullptr || set != options.trigger) {
    throw DeviceError(fmt::format(
        "camera {}: it doesn't take the trigger '{}' ({}); it has {}",
        options.id,
        options.trigger,
        refused.empty() ? "read back another" : refused,
        Names([&](guint* count, GError** out) {
          return arv_camera_dup_available_trigger_sources(camera, count, out);
        })));
  }
}

void SetPacketSize(ArvCamera* camera, const AravisOptions& options) {
  if (!arv_camera_is_gv_device(camera)) {
    return;
  }
  GErrorSlot error;
  // Of Aravis' two ways to receive, the packet socket takes in all of an interface
  // until its filter is set, packets of another camera's frames too, and can't tell
  // them from this camera's. The plain socket gets what is sent to its port, and needs
  // no rights.
  arv_camera_gv_set_stream_options(camera, ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
  arv_camera_gv_set_packet_size_adjustment(camera, ARV_GV_PACKET_SIZE_ADJUSTMENT_NEVER);
  arv_camera_gv_set_packet_size(camera, options.packet_size_bytes, error.out());
  error.Check(options.id, "set its packet size");
  const guint set = arv_camera_gv_get_packet_size(camera, error.out());
  error.Check(options.id, "read its packet size");
  if (set != static_cast<guint>(options.packet_size_bytes)) {
    throw DeviceError(
        fmt::format("camera {}: asked for packets of {} bytes it takes "
                    "{}; write what it takes",
                    options.id,
                    options.packet_size_bytes,
                    set));
  }
}

}  // namespace

const PixelFormat& WantedFormat(const AravisOptions& options) {
  const PixelFormat* format = FindPixelFormat(options.pixel_format);
  if (format == nullptr) {
    throw DeviceError(
        fmt::format("camera {}: '{}' isn't a pixel format that Nacre "
                    "reads; these are: {}",
                    options.id,
                    options.pixel_format,
                    PixelFormatNames()));
  }
  return *format;
}

void ApplySettings(ArvCamera* camera, const AravisOptions& options) {
  // Without it out-of-range values go to the camera, which may take anything for them.
  arv_camera_set_range_check_policy(camera, ARV_RANGE_CHECK_POLICY_ENABLE);
  if (arv_camera_is_uv_device(camera)) {
    // The asynchronous mode of Aravis before 0.8.28 can wait for ever.
    arv_camera_uv_set_usb_mode(camera, ARV_UV_USB_MODE_SYNC);
  }
  SetPixelFormat(camera, options);
  SetRegion(camera, options);
  SwitchOffAutomatics(camera, options.id);
  SetGain(camera, options);
  SetTrigger(camera, options);
  SetPacketSize(camera, options);
}

CameraInfo ReadInfo(ArvCamera* camera, const AravisOptions& options) {
  GErrorSlot error;
  const auto text = [&](const char* found, const char* what) {
    error.Check(options.id, what);
    return std::string(found == nullptr ? "" : found);
  };
  CameraInfo info;
  const std::string vendor =
      text(arv_camera_get_vendor_name(camera, error.out()), "read its vendor");
  info.model = vendor + ' ' +
               text(arv_camera_get_model_name(camera, error.out()), "read its model");
  info.serial = text(arv_camera_get_device_serial_number(camera, error.out()),
                     "read its serial number");
  SensorRegion region;
  arv_camera_get_region(
      camera, &region.x, &region.y, &region.width, &region.height, error.out());
  error.Check(options.id, "read its region");
  info.width = region.width;
  info.height = region.height;
  info.bit_depth = WantedFormat(options).bit_depth;
  info.mosaic = WantedFormat(options).mosaic;
  arv_camera_get_exposure_time_bounds(
      camera, &info.min_exposure_us, &info.max_exposure_us, error.out());
  error.Check(options.id, "read the range of its exposure");
  return info;
}

double ApplyExposureUs(ArvCamera* camera, const std::string& name, double exposure_us) {
  GErrorSlot error;
  double min_us = 0;
  double max_us = 0;
  arv_camera_get_exposure_time_bounds(camera, &min_us, &max_us, error.out());
  error.Check(name, "read the range of its exposure");
  if (!(exposure_us >= min_us && exposure_us <= max_us)) {
    throw DeviceError(
        fmt::format("camera {}: an exposure of {} us is outside of its [{}, {}] us",
                    name,
                    exposure_us,
                    min_us,
                    max_us));
  }
  arv_camera_set_exposure_time(camera, exposure_us, error.out());
  error.Check(name, "set its exposure");
  const double applied_us = arv_camera_get_exposure_time(camera, error.out());
  error.Check(name, "read its exposure");
  return applied_us;
}

}  // namespace nacre::acquire::internal
