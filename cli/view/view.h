#pragma once

#include "cli/web/local_server.h"
#include "core/progress.h"

#include <filesystem>
#include <map>
#include <string>

namespace nacre::cli::view {

/// What the page on a file answers by name (README.md): a dataset, a material, a
/// preset's folder or a session's folder. `against`, if not empty, is a dataset or a
/// material on the same grid, whose slices are shown beside. Throws what the file's
/// reader throws, BadData for a file of another kind or another grid.
std::map<std::string, web::Handler> OpenView(const std::filesystem::path& path,
                                             const std::filesystem::path& against,
                                             const ProgressFunction& progress);

/// OpenView's parts.
std::map<std::string, web::Handler> SampleView(const std::filesystem::path& path,
                                               const std::filesystem::path& against,
                                               const ProgressFunction& progress);
/// Adds to a material's view what `folder`/preset.toml says.
std::map<std::string, web::Handler> PresetView(const std::filesystem::path& folder,
                                               const std::filesystem::path& against);
std::map<std::string, web::Handler> SessionView(const std::filesystem::path& folder);

}  // namespace nacre::cli::view
