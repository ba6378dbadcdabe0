#include "render/jensen_media.h"

#include <algorithm>
#include <array>
#include <cctype>

namespace nacre::render {
namespace {

// Red absorption of chicken is often quoted ten times too low; these values reproduce
// the reflectances of the paper's own table.
constexpr std::array<JensenMedium, 12> kMedia = {{
    {"apple", {2.29F, 2.39F, 1.97F}, {0.003F, 0.0034F, 0.046F}, 1.3F},
    {"chicken1", {0.15F, 0.21F, 0.38F}, {0.015F, 0.077F, 0.19F}, 1.3F},
    {"chicken2", {0.19F, 0.25F, 0.32F}, {0.018F, 0.088F, 0.2F}, 1.3F},
    {"cream", {7.38F, 5.47F, 3.15F}, {0.0002F, 0.0028F, 0.0163F}, 1.3F},
    {"ketchup", {0.18F, 0.07F, 0.03F}, {0.061F, 0.97F, 1.45F}, 1.3F},
    {"marble", {2.19F, 2.62F, 3.00F}, {0.0021F, 0.0041F, 0.0071F}, 1.5F},
    {"potato", {0.68F, 0.70F, 0.55F}, {0.0024F, 0.009F, 0.12F}, 1.3F},
    {"skimmilk", {0.70F, 1.22F, 1.90F}, {0.0014F, 0.0025F, 0.0142F}, 1.3F},
    {"skin1", {0.74F, 0.88F, 1.01F}, {0.032F, 0.17F, 0.48F}, 1.3F},
    {"skin2", {1.09F, 1.59F, 1.79F}, {0.013F, 0.07F, 0.145F}, 1.3F},
    {"spectralon", {11.6F, 20.4F, 14.9F}, {0, 0, 0}, 1.3F},
    {"wholemilk", {2.55F, 3.21F, 3.77F}, {0.0011F, 0.0024F, 0.014F}, 1.3F},
}};

}  // namespace

std::optional<JensenMedium> FindJensenMedium(const std::string& name) {
  std::string lower = name;
  std::transform(lower.begin(), lower.end(), lower.begin(), [](char c) {
    return static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  });
  for (const JensenMedium& medium : kMedia) {
    if (lower == medium.name) {
      return medium;
    }
  }
  return std::nullopt;
}

std::vector<std::string> JensenMediumNames() {
  std::vector<std::string> names;
  for (const JensenMedium& medium : kMedia) {
    names.emplace_back(medium.name);
  }
  return names;
}

}  // namespace nacre::render
