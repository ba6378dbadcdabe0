#pragma once

#include "core/progress.h"

#include <filesystem>
#include <string>

namespace nacre::cli::report {

/// The HTML page on an artefact (a dataset, material, picture, session folder or JSON
/// file) or on a folder of artefacts, such as the demo leaves: everything in pictures,
/// inline, with the names and hashes of what they are of. The same artefacts give the
/// same bytes. Throws BadData for a file of another kind, and what the artefacts'
/// readers throw.
std::string BuildReport(const std::filesystem::path& path,
                        const ProgressFunction& progress = {});

}  // namespace nacre::cli::report
