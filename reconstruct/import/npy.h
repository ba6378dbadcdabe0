#pragma once

#include "reconstruct/import/array.h"

namespace nacre::reconstruct {

/// A NumPy array file (.npy, versions 1 to 3; C or Fortran order; u1, u2, f4, f8 of
/// either byte order) to `*.rd.exr`. The file is mapped, so that a slice at a time is
/// in memory. Throws BadData for anything that isn't a whole file of that kind.
ImportSummary ImportNpy(const std::filesystem::path& from,
                        const std::filesystem::path& to,
                        const ImportOptions& options,
                        const ArrayImportOptions& array_options,
                        const ProgressFunction& progress = {});

}  // namespace nacre::reconstruct
