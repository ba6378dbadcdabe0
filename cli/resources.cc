#include "cli/resources.h"

#include "core/error.h"

#include <cstdlib>
#include <vector>

namespace nacre::cli {

std::filesystem::path FindResource(const std::string& name) {
  std::vector<std::filesystem::path> folders;
  if (const char* data = std::getenv("NACRE_DATA"); data != nullptr && *data != '\0') {
    folders.emplace_back(data);
  }
  const auto bin = std::filesystem::read_symlink("/proc/self/exe").parent_path();
  folders.push_back(bin / "share" / "nacre");
  folders.push_back(bin.parent_path() / "share" / "nacre");
  std::string looked;
  for (const auto& folder : folders) {
    if (std::filesystem::exists(folder / name)) {
      return folder / name;
    }
    looked += "\n  " + (folder / name).string();
  }
  throw Error("cannot find " + name + ", which comes with nacre; looked for" + looked +
              "\nSet NACRE_DATA to the folder that holds it.");
}

}  // namespace nacre::cli
