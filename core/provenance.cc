#include "core/provenance.h"

#include "core/hash.h"
#include "core/version.h"

namespace nacre {

void Provenance::AddInput(const std::filesystem::path& path) {
  inputs.push_back({{"file", path.filename().string()}, {"xxh3", HashFile(path)}});
}

std::string Provenance::ToString() const {
  return Json{{"software", "nacre"},
              {"version", Version()},
              {"command", command},
              {"options", options},
              {"inputs", inputs}}
      .dump();
}

}  // namespace nacre
