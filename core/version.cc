#include "core/version.h"

#include "core/version_values.h"

#include <OpenEXR/OpenEXRConfig.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <png.h>
#include <tbb/version.h>
#include <xxhash.h>

namespace nacre {

std::string Version() {
  return NACRE_VERSION;
}

std::string LibraryVersions() {
  return fmt::format(
      "OpenEXR {}\noneTBB {}.{}\nlibpng {}\nxxHash {}.{}.{}\n{{fmt}} {}\nnlohmann-json "
      "{}.{}.{}\n",
      OPENEXR_VERSION_STRING,
      TBB_VERSION_MAJOR,
      TBB_VERSION_MINOR,
      PNG_LIBPNG_VER_STRING,
      XXH_VERSION_MAJOR,
      XXH_VERSION_MINOR,
      XXH_VERSION_RELEASE,
      FMT_VERSION,
      NLOHMANN_JSON_VERSION_MAJOR,
      NLOHMANN_JSON_VERSION_MINOR,
      NLOHMANN_JSON_VERSION_PATCH);
}

}  // namespace nacre
