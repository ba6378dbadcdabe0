#include "cli/exchange/targets.h"
#include "core/atomic_file.h"

#include "generated/cli/exchange/cycles_script.h"

namespace nacre::exchange {

Files WriteCycles(const ProfileFit& fit, const std::filesystem::path& folder) {
  Files files;
  WriteMap(fit.maps, fit.maps.albedo, 1, folder / "albedo.exr", files);
  WriteMap(fit.maps, fit.maps.d_mm, 1, folder / "radius.exr", files);
  WriteFile(folder / "nacre_material.py", kCyclesScript);
  files.emplace_back("nacre_material.py");
  return files;
}

}  // namespace nacre::exchange
