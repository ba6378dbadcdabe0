#include "core/atomic_file.h"
#include "core/little_endian.h"
#include "factor/sss.h"
#include "tests/fuzz/fuzz.h"

#include <string>

namespace nacre::fuzz {
namespace {

// All windows are summed, which few bytes declare to be large: allowed, but minutes
// under sanitizers.
bool TakesLong(const std::string& bytes) {
  if (bytes.size() < 16) {
    return false;
  }
  const double core = LoadLittle32(
      static_cast<const unsigned char*>(static_cast<const void*>(&bytes[12])));
  constexpr double kMostAllowedCore = 511;
  return core <= kMostAllowedCore &&
         core * core * static_cast<double>(bytes.size()) > 4e6;
}

}  // namespace

const char* const kFileName = "scan.sss";

void Read(const std::filesystem::path& path) {
  if (!TakesLong(ReadFile(path))) {
    factor::ReadSss(path, {.pitch_mm = 1});
  }
}

}  // namespace nacre::fuzz
