#pragma once

#include "calibrate/corrections.h"
#include "core/json_fwd.h"

#include <string>

namespace nacre::calibrate::internal {

Json ToJson(const Corrections& corrections);

/// Throws BadData naming `origin` and field for anything missing or senseless, as would
/// be a hot pixel outside of the `pixel_count` there are.
Corrections CorrectionsFromJson(const Json& json,
                                const std::string& origin,
                                std::int64_t pixel_count,
                                std::size_t channel_count);

}  // namespace nacre::calibrate::internal
