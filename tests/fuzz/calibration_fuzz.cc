#include "calibrate/calibration.h"
#include "tests/fuzz/fuzz.h"

namespace nacre::fuzz {

const char* const kFileName = "c.json";

void Read(const std::filesystem::path& path) {
  calibrate::ReadCalibration(path);
}

}  // namespace nacre::fuzz
