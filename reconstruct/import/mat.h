#pragma once

#include "reconstruct/import/array.h"

namespace nacre::reconstruct {

/// An array of a MATLAB file (version 5 or 7.3) to `*.rd.exr`, by libmatio. Read is
/// the variable that `array_options` names, or the only real array of four or five
/// axes. The whole variable is held in memory while its slices are written. Throws
/// BadData for a damaged file, and for arrays that unpack to more than `max_bytes`.
ImportSummary ImportMat(const std::filesystem::path& from,
                        const std::filesystem::path& to,
                        const ImportOptions& options,
                        const ArrayImportOptions& array_options,
                        const ProgressFunction& progress = {},
                        std::size_t max_bytes = std::size_t{16} << 30);

}  // namespace nacre::reconstruct
