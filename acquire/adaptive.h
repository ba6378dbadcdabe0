#pragma once

#include "acquire/adaptive_plan.h"
#include "acquire/session.h"
#include "acquire/session_writer.h"

#include <cstdint>
#include <functional>
#include <string>
#include <utility>

namespace nacre::acquire {

/// Where the camera sees a point of the sample plane: x, y in pixels, the centre of the
/// upper left pixel is (0, 0).
using PixelFromSample = std::function<std::pair<double, double>(PointMm)>;

/// Looks at the preview of the sample: all pictures of the first group of spots, which
/// is spread over all of it. What is above the noise floor is judged by the dark
/// pictures of the same exposure; pixels that are bright in the dark don't count.
/// - A channel's longest exposure is left out from then on if it shows light in no
/// pixel
///   where the next shorter one doesn't; and so on down the bracket.
/// - A spot is empty if no channel's longest exposure shows light in the core around
/// it.
///   Grid points are skipped if all spots of the preview that enclose them are empty.
///   Without `pixel_from_sample` none is.
AdaptivePlan PlanFromPreview(const SessionReader& session,
                             const PixelFromSample& pixel_from_sample);

/// Why picture `number` of the sample needn't be taken; empty if it must. Depends on
/// nothing but the session, so that a resumed capture decides the same. Calls `settle`
/// before it looks at pictures before it, which must be in the session then.
std::string WhySkip(const SessionWriter& session,
                    std::int64_t number,
                    const std::function<void()>& settle);

}  // namespace nacre::acquire
