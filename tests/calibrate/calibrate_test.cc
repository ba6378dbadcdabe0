// The whole of calibration against rigs whose truth the test knows.

#include "calibrate/calibrate.h"

#include "calibrate/geometry.h"
#include "calibrate/laser_map.h"
#include "calibrate/radiometry.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "tests/calibrate/synthetic_rig.h"
#include "tests/support/temp_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace nacre::calibrate {
namespace {

using testing::CaptureSynthetic;
using ::testing::HasSubstr;
using testing::SyntheticRigToml;
using testing::SyntheticTruth;
using testing::TempFolder;

constexpr double kPixelMm = 0.37;  // on the sample plane, about

// Captured and calibrated once for the tests that only look at the result.
class CalibrateSynthetic : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TempFolder;
    CaptureSynthetic(SyntheticTruth(), SyntheticRigToml(), *folder_ / "s");
    calibration_ = new Calibration(
        Calibrate(acquire::SessionReader(*folder_ / "s"), CalibrateOptions()));
  }
  static void TearDownTestSuite() {
    delete calibration_;
    delete folder_;
  }

  static TempFolder* folder_;
  static Calibration* calibration_;
  const SyntheticTruth truth_ = {};
};

TempFolder* CalibrateSynthetic::folder_ = nullptr;
Calibration* CalibrateSynthetic::calibration_ = nullptr;

TEST_F(CalibrateSynthetic, CornersAreMetToATenthOfAPixel) {
  EXPECT_LE(calibration_->reprojection_rms_px, 0.1);
  EXPECT_GT(calibration_->reprojection_rms_px, 0);
}

TEST_F(CalibrateSynthetic, SamplePlaneIsFoundToATenthOfAPixel) {
  for (double x = -45; x <= 45; x += 15) {
    for (double y = -30; y <= 30; y += 15) {
      const cv::Point2d pixel = testing::TruePixel(truth_, {x, y});
      const PointMm found = calibration_->camera.SampleFromPixel({pixel.x, pixel.y});
      EXPECT_LT(std::hypot(found.x - x, found.y - y), 0.1 * kPixelMm)
          << "at " << x << ", " << y;
    }
  }
}

TEST_F(CalibrateSynthetic, DirectionToTheCamera) {
  const cv::Vec3d centre = testing::TrueCameraCentre(truth_);
  for (const PointMm point : {PointMm{0, 0}, PointMm{40, -20}, PointMm{-40, 20}}) {
    const cv::Vec3d out = centre - cv::Vec3d(point.x, point.y, 0);
    EXPECT_NEAR(calibration_->camera.CosOut(point), out[2] / cv::norm(out), 0.01);
  }
}

TEST_F(CalibrateSynthetic, LaserIsAimedToATenthOfAPixel) {
  EXPECT_LT(calibration_->laser_map_rms_mm, 0.05 * kPixelMm);
  EXPECT_GE(calibration_->laser_map_max_mm, calibration_->laser_map_rms_mm);
  for (double x = -43.5; x <= 43.5; x += 14.5) {
    for (double y = -28.5; y <= 28.5; y += 9.5) {
      const PointMm hit =
          truth_.LaserAt(calibration_->scan_map.AngleFromSample({x, y}));
      EXPECT_LT(std::hypot(hit.x - x, hit.y - y), 0.1 * kPixelMm)
          << "at " << x << ", " << y;
    }
  }
}

TEST_F(CalibrateSynthetic, ScanMapIsItsOwnInverse) {
  for (double x = -43.5; x <= 43.5; x += 14.5) {
    const acquire::ScanMap& map = calibration_->scan_map;
    const PointMm back = map.SampleFromAngle(map.AngleFromSample({x, -0.5 * x}));
    EXPECT_NEAR(back.x, x, 0.05 * kPixelMm);
    EXPECT_NEAR(back.y, -0.5 * x, 0.05 * kPixelMm);
  }
}

TEST_F(CalibrateSynthetic, Radiometry) {
  // A pair of 128,000 pixels gives its variance to 0.4 %.
  EXPECT_NEAR(calibration_->gain_electrons_per_count, 4, 4 * 0.015);
  EXPECT_NEAR(calibration_->read_noise_electrons, 8, 8 * 0.015);
  // The mean of a picture has a noise of 2 counts / √128,000 = 0.006.
  EXPECT_NEAR(calibration_->dark.offset_counts, 60, 0.02);
  EXPECT_NEAR(calibration_->dark.Counts(20000), 60.4, 0.02);
  EXPECT_EQ(calibration_->saturation_counts, 4095);
}

TEST_F(CalibrateSynthetic, FluxScale) {
  ASSERT_EQ(calibration_->channels.size(), 2U);
  EXPECT_EQ(calibration_->channels[0].name, "R");
  EXPECT_EQ(calibration_->channels[1].name, "G");
  EXPECT_NEAR(
      calibration_->channels[0].flux_scale_counts_mm2_sr_per_us, 900, 900 * 0.005);
  EXPECT_NEAR(
      calibration_->channels[1].flux_scale_counts_mm2_sr_per_us, 500, 500 * 0.005);
  EXPECT_LT(calibration_->channels[0].flux_scale_spread, 0.05);
}

TEST_F(CalibrateSynthetic, ScanMapAloneIsTheSame) {
  const acquire::SessionReader session(*folder_ / "s");
  EXPECT_EQ(EstimateScanMap(session, {}), calibration_->scan_map);
}

TEST_F(CalibrateSynthetic, SamePicturesSameBytes) {
  const acquire::SessionReader session(*folder_ / "s");
  WriteCalibration(*folder_ / "a.json", *calibration_);
  WriteCalibration(*folder_ / "b.json", Calibrate(session, CalibrateOptions()));
  EXPECT_EQ(ReadFile(*folder_ / "a.json"), ReadFile(*folder_ / "b.json"));
}

TEST_F(CalibrateSynthetic, AWorseFitThanAllowedIsRefused) {
  const acquire::SessionReader session(*folder_ / "s");
  const auto error_of = [&](const CalibrateOptions& options) -> std::string {
    try {
      Calibrate(session, options);
    } catch (const Error& e) {
      return e.what();
    }
    return "no error";
  };
  CalibrateOptions options;
  options.max_reprojection_rms_px = 1e-6;
  EXPECT_THAT(error_of(options), HasSubstr("max_reprojection_rms_px = 1e-06"));
  options = {};
  options.max_laser_map_rms_mm = 1e-6;
  EXPECT_THAT(error_of(options), HasSubstr("max_laser_map_rms_mm = 1e-06"));
}

TEST_F(CalibrateSynthetic, StopsWhenAskedTo) {
  const acquire::SessionReader session(*folder_ / "s");
  try {
    Calibrate(session, {}, [](const Progress&) { return false; });
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::kInterrupted);
  }
}

// What goes wrong at a rig, and what the user is told.
std::string ErrorWith(const SyntheticTruth& truth,
                      std::vector<std::pair<std::string, std::string>> edits = {}) {
  edits.emplace_back("checkerboard_poses = 8", "checkerboard_poses = 4");
  edits.emplace_back("reference_frames = 2", "reference_frames = 1");
  const TempFolder folder;
  CaptureSynthetic(truth, SyntheticRigToml(edits), folder / "s");
  try {
    Calibrate(acquire::SessionReader(folder / "s"), CalibrateOptions());
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::kBadData);
    return e.what();
  }
  return "no error";
}

TEST(CalibrateErrors, NoBoard) {
  SyntheticTruth truth;
  truth.no_board = true;
  EXPECT_THAT(ErrorWith(truth), HasSubstr("no checkerboard of 9 x 6 inner corners"));
}

TEST(CalibrateErrors, CameraTurnedByAQuarter) {
  SyntheticTruth truth;
  truth.roll_rad = 1.6;
  truth.distance_mm = 520;  // the board must fit across the picture
  EXPECT_THAT(ErrorWith(truth), HasSubstr("turn the camera upright"));
}

TEST(CalibrateErrors, TooMuchOfTheLatticeIsMissing) {
  SyntheticTruth truth;
  truth.dropped_spots = 8;
  EXPECT_THAT(ErrorWith(truth),
              HasSubstr("7 x 7 laser spots on the reference target can't be made out"));
}

TEST(CalibrateErrors, ASpotMayBeMissing) {
  SyntheticTruth truth;
  truth.dropped_spots = 1;
  EXPECT_EQ(ErrorWith(truth), "no error");
}

TEST(CalibrateErrors, ReferenceOverexposed) {
  EXPECT_THAT(ErrorWith(SyntheticTruth(),
                        {{"reference_exposure_us = 10", "reference_exposure_us = 60"}}),
              HasSubstr("lower targets.reference_exposure_us"));
}

TEST(CalibrateErrors, FlatsNotLit) {
  SyntheticTruth truth;
  truth.flat_counts_per_us = 0;
  EXPECT_THAT(ErrorWith(truth),
              HasSubstr("flat pictures are hardly noisier than the dark"));
}

TEST(Radiometry, AWellThatIsFullBeforeTheConverterIsFound) {
  SyntheticTruth truth;
  truth.saturation_counts = 3000;
  const TempFolder folder;
  CaptureSynthetic(
      truth,
      SyntheticRigToml({{"[2000, 6000, 12000]", "[2000, 6000, 12000, 18000]"}}),
      folder / "s");
  const acquire::SessionReader session(folder / "s");
  const PhotonTransfer transfer =
      EstimatePhotonTransfer(session, EstimateDarkMaps(session));
  // Read noise is 2 counts: six of them below the pile-up.
  EXPECT_NEAR(transfer.saturation_counts, 3000 - 12, 6);
  EXPECT_NEAR(transfer.gain_electrons_per_count, 4, 4 * 0.015);
}

}  // namespace
}  // namespace nacre::calibrate
