#pragma once

#include "cli/exchange/profile_fit.h"

#include <array>
#include <filesystem>
#include <string>
#include <vector>

namespace nacre::exchange {

using Files = std::vector<std::string>;

/// One file each: textures are EXR, half, linear, the top row at v = 1.
Files WriteCycles(const ProfileFit& fit, const std::filesystem::path& folder);
Files WritePbrt(const ProfileFit& fit, const std::filesystem::path& folder);
Files WriteMaterialX(const ProfileFit& fit, const std::filesystem::path& folder);
Files WriteRenderMan(const ProfileFit& fit, const std::filesystem::path& folder);
Files WriteAppleseed(const ProfileFit& fit, const std::filesystem::path& folder);
Files WriteMitsuba(const ProfileFit& fit, const std::filesystem::path& folder);

/// Mean free paths l = s(A) d of all pixels, mm (burley.h).
std::vector<float> MeanFreePaths(const ProfileMaps& maps);
float Largest(const std::vector<float>& values);
/// Mean over the sample, as R, G, B.
std::array<double, 3> MeanColor(const ProfileMaps& maps,
                                const std::vector<float>& values);
std::string Triple(const std::array<double, 3>& color, const char* separator);

/// Writes `values` · scale as `name` and adds the name to `files`.
void WriteMap(const ProfileMaps& maps,
              const std::vector<float>& values,
              double scale,
              const std::filesystem::path& path,
              Files& files);

}  // namespace nacre::exchange
