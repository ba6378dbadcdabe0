#pragma once

#include "cli/exchange/profile_fit.h"

#include <filesystem>
#include <string>
#include <vector>

namespace nacre::exchange {

/// A renderer that takes Burley's profile, or the nearest that it has.
struct Target {
  const char* name;     ///< of `nacre export --to`
  const char* program;  ///< for people
  const char* lost;     ///< what of the material it can't take
  /// Writes its files into `folder`; returns their names.
  std::vector<std::string> (*write)(const ProfileFit& fit,
                                    const std::filesystem::path& folder);
};

const std::vector<Target>& Targets();
const Target* FindTarget(const std::string& name);

/// Writes the target's files and `export.json` (units, residual of the fit, what was
/// lost, provenance) into `folder`. `file` is what the fit is of, `source` its name for
/// people. Throws UsageError unless the maps have one channel or R, G, B.
Json ExportMaps(const Target& target,
                const ProfileFit& fit,
                const std::filesystem::path& file,
                const std::string& source,
                const std::filesystem::path& folder);

}  // namespace nacre::exchange
