#pragma once

#include "acquire/session.h"
#include "calibrate/calibration.h"
#include "reconstruct/rd_dataset.h"
#include "tests/support/temp_folder.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

namespace nacre::reconstruct {

/// A simulated session of a striped sample, its calibration and the truth, made once
/// for all tests: it is most of their work.
class StripedSession : public ::testing::Test {
 protected:
  static constexpr std::uint64_t kSeed = 77;

  static void SetUpTestSuite();
  static void TearDownTestSuite() { shared.reset(); }

  static acquire::SessionReader Session() {
    return acquire::SessionReader(shared->folder / "session");
  }
  static std::filesystem::path Path(const std::string& name) {
    return shared->folder / name;
  }

  struct Shared {
    testing::TempFolder folder;
    calibrate::Calibration calibration;
    std::function<RdSlice(const RdHeader&, int, int)> truth;
  };
  static std::unique_ptr<Shared> shared;
};

/// Captures the rig of `folder` into folder / name.
void CaptureStripes(const std::filesystem::path& folder,
                    const std::string& name,
                    std::uint64_t seed);

}  // namespace nacre::reconstruct
