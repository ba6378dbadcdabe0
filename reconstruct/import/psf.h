#pragma once

#include "core/progress.h"
#include "reconstruct/import/import.h"

#include <filesystem>

namespace nacre::reconstruct {

/// Raw "psf" scan (layout: reconstruct/README.md) to `*.rd.exr`, slice by slice,
/// keeping the bits of every float. Throws BadData if sizes make no sense or don't
/// match the length of the file (both are named), and for a NaN, an infinity or a
/// negative value (the pixel is named).
ImportSummary ImportPsf(const std::filesystem::path& from,
                        const std::filesystem::path& to,
                        const ImportOptions& options,
                        const ProgressFunction& progress = {});

}  // namespace nacre::reconstruct
