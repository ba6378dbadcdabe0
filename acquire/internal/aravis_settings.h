#pragma once

#include "acquire/aravis_options.h"
#include "acquire/camera.h"
#include "acquire/internal/aravis_handles.h"
#include "acquire/pixel_format.h"

#include <string>

namespace nacre::acquire::internal {

/// Sets what the options ask for, and what a measurement takes for granted: no
/// automatic exposure or gain, one frame a trigger. Reads everything back. Throws
/// DeviceError for what the camera refuses or changes, with the values that it takes.
void ApplySettings(ArvCamera* camera, const AravisOptions& options);

/// The format that the options ask for; DeviceError if it isn't a monochrome one.
const PixelFormat& WantedFormat(const AravisOptions& options);

/// As set now.
CameraInfo ReadInfo(ArvCamera* camera, const AravisOptions& options);

/// Returns what was applied; DeviceError out of the camera's range.
double ApplyExposureUs(ArvCamera* camera, const std::string& name, double exposure_us);

}  // namespace nacre::acquire::internal
