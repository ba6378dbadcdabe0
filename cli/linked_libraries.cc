#include "cli/linked_libraries.h"

#include "core/version.h"

#include <CLI/Version.hpp>
#include <algorithm>
#include <filesystem>
#include <fmt/format.h>
#include <link.h>
#include <vector>

namespace nacre::cli {
namespace {

extern "C" int AddLibrary(dl_phdr_info* info, std::size_t /*size*/, void* data) {
  const std::string path = info->dlpi_name;
  if (path.find('/') != std::string::npos) {
    static_cast<std::vector<std::string>*>(data)->push_back(path);
  }
  return 0;
}

}  // namespace

std::string LinkedLibraries() {
  std::vector<std::string> paths;
  dl_iterate_phdr(AddLibrary, &paths);
  std::sort(paths.begin(), paths.end());
  std::string text = LibraryVersions();
  text += fmt::format("CLI11 {}\n", CLI11_VERSION);
#ifdef NACRE_EIGEN_VERSION
  text += fmt::format("Eigen {}\n", NACRE_EIGEN_VERSION);
#endif
  for (const std::string& path : paths) {
    std::error_code none;  // the name says the version where it is a link's target
    const std::filesystem::path file = std::filesystem::canonical(path, none);
    text += (none ? path : file.string()) + '\n';
  }
  return text;
}

}  // namespace nacre::cli
