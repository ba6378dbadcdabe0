#include "calibrate/calibration.h"

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/fresnel.h"
#include "core/json.h"
#include "tests/support/error_message.h"
#include "tests/support/temp_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

#include <cmath>
#include <numbers>

namespace nacre::calibrate {
namespace {

using ::testing::HasSubstr;
using testing::TempFolder;

// A camera leaned by 0.2 rad, 500 mm away.
CameraGeometry LeanedCamera() {
  CameraGeometry camera;
  camera.width_px = 640;
  camera.height_px = 480;
  camera.fx_px = 1500;
  camera.fy_px = 1490;
  camera.cx_px = 321;
  camera.cy_px = 238;
  camera.k1 = -0.15;
  camera.k2 = 0.08;
  camera.p1 = 5e-4;
  camera.p2 = -7e-4;
  camera.k3 = 0.02;
  const double c = std::cos(0.2);
  const double s = std::sin(0.2);
  camera.camera_from_sample_rotation = {1, 0, 0, 0, -c, -s, 0, s, -c};
  camera.camera_from_sample_translation_mm = {3, -4, 500};
  return camera;
}

Calibration SomeCalibration() {
  Calibration calibration;
  calibration.camera = LeanedCamera();
  calibration.dark = {60.5, 1e-4};
  calibration.gain_electrons_per_count = 4;
  calibration.read_noise_electrons = 8;
  calibration.saturation_counts = 4095;
  calibration.channels = {{"R", 700.25, 0.01}, {"638nm", 1.0 / 3, 0}};
  calibration.scan_map.x_rad[1] = 1.0 / 300;
  calibration.scan_map.y_rad[2] = 1.0 / 300;
  calibration.scan_map.x_mm[1] = 300;
  calibration.scan_map.y_mm[2] = 300;
  calibration.reprojection_rms_px = 0.05;
  calibration.laser_map_rms_mm = 0.01;
  calibration.laser_map_max_mm = 0.03;
  calibration.session_rig_hash = "abc";
  calibration.provenance = "{\"command\":\"calibrate\"}";
  return calibration;
}

TEST(CameraGeometry, ProjectsAsOpenCvDoes) {
  const CameraGeometry camera = LeanedCamera();
  const cv::Matx33d matrix(1500, 0, 321, 0, 1490, 238, 0, 0, 1);
  const std::vector<double> distortion{-0.15, 0.08, 5e-4, -7e-4, 0.02};
  cv::Vec3d rotation;
  cv::Rodrigues(cv::Matx33d(camera.camera_from_sample_rotation.data()), rotation);
  for (double x = -80; x <= 80; x += 40) {
    for (double y = -60; y <= 60; y += 30) {
      std::vector<cv::Point2d> expected;
      cv::projectPoints(std::vector<cv::Point3d>{{x, y, 0}},
                        rotation,
                        cv::Vec3d(3, -4, 500),
                        matrix,
                        distortion,
                        expected);
      const PixelPoint pixel = camera.PixelFromSample({x, y});
      EXPECT_NEAR(pixel.x, expected[0].x, 1e-9);
      EXPECT_NEAR(pixel.y, expected[0].y, 1e-9);
      const PointMm back = camera.SampleFromPixel(pixel);
      EXPECT_NEAR(back.x, x, 1e-8);
      EXPECT_NEAR(back.y, y, 1e-8);
    }
  }
}

TEST(CameraGeometry, PixelYRunsDownAndSampleYUp) {
  const CameraGeometry camera = LeanedCamera();
  EXPECT_GT(camera.PixelFromSample({10, 0}).x, camera.PixelFromSample({0, 0}).x);
  EXPECT_LT(camera.PixelFromSample({0, 10}).y, camera.PixelFromSample({0, 0}).y);
}

TEST(CameraGeometry, CosineOfAnAnalyticCase) {
  CameraGeometry camera = LeanedCamera();
  camera.camera_from_sample_rotation = {1, 0, 0, 0, -1, 0, 0, 0, -1};
  camera.camera_from_sample_translation_mm = {0, 0, 300};
  EXPECT_DOUBLE_EQ(camera.CosOut({0, 0}), 1);
  EXPECT_DOUBLE_EQ(camera.CosOut({300, 0}), 1 / std::numbers::sqrt2);
  EXPECT_DOUBLE_EQ(camera.CosOut({0, 400}), 0.6);
}

TEST(CameraGeometry, FootprintsAddUpToTheArea) {
  CameraGeometry camera = LeanedCamera();
  camera.camera_from_sample_rotation = {1, 0, 0, 0, -1, 0, 0, 0, -1};
  camera.camera_from_sample_translation_mm = {0, 0, 300};
  camera.k1 = camera.k2 = camera.p1 = camera.p2 = camera.k3 = 0;
  EXPECT_NEAR(camera.FootprintMm2({100, 50}), 300.0 * 300.0 / (1500.0 * 1490.0), 1e-12);
  // Leaned and distorted: pixels × footprint over a small square against its own area.
  const CameraGeometry leaned = LeanedCamera();
  const PixelPoint a = leaned.PixelFromSample({20, 20});
  const PixelPoint b = leaned.PixelFromSample({20.1, 20});
  const PixelPoint c = leaned.PixelFromSample({20, 20.1});
  const double pixels = std::abs((b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x));
  EXPECT_NEAR(pixels * leaned.FootprintMm2(a), 0.01, 1e-5);
}

TEST(Calibration, RdOfALambertianThoughtExperiment) {
  // Light enters and leaves along the normal: R_d = π c / F_t² · rate / scale, worked
  // out with the normal-incidence formula F_t = 4 η / (1 + η)².
  Calibration calibration = SomeCalibration();
  calibration.camera.camera_from_sample_rotation = {1, 0, 0, 0, -1, 0, 0, 0, -1};
  calibration.camera.camera_from_sample_translation_mm = {0, 0, 300};
  const double eta = 1.5;
  const double transmittance = 4 * eta / ((1 + eta) * (1 + eta));
  EXPECT_NEAR(calibration.RdPerRate(0, {0, 0}, {0, 0}, eta),
              std::numbers::pi * ExitNormalization(eta) /
                  (transmittance * transmittance * 700.25),
              1e-12);
  // Another index right after: nothing is remembered wrongly.
  EXPECT_NEAR(
      calibration.RdPerRate(1, {0, 0}, {0, 0}, 1), std::numbers::pi / (1.0 / 3), 1e-6);
  // Off the normal at either end less gets through, so the same rate means more.
  EXPECT_GT(calibration.RdPerRate(0, {0, 0}, {500, 0}, eta),
            calibration.RdPerRate(0, {0, 0}, {0, 0}, eta));
  EXPECT_GT(calibration.RdPerRate(0, {400, 0}, {0, 0}, eta),
            calibration.RdPerRate(0, {0, 0}, {0, 0}, eta));
}

TEST(Calibration, CosineOfTheBeam) {
  const Calibration calibration = SomeCalibration();
  EXPECT_DOUBLE_EQ(calibration.CosIn({0, 0}), 1);
  EXPECT_NEAR(calibration.CosIn({60, 0}), std::cos(0.2), 1e-12);
}

TEST(Calibration, VarianceIsReadShotAndRounding) {
  const Calibration calibration = SomeCalibration();
  EXPECT_DOUBLE_EQ(calibration.VarianceCounts2(0), 4 + 1.0 / 12);
  EXPECT_DOUBLE_EQ(calibration.VarianceCounts2(400), 104 + 1.0 / 12);
}

TEST(CalibrationFile, RoundTripKeepsEveryBit) {
  const TempFolder folder;
  WriteCalibration(folder / "c.json", SomeCalibration());
  const Calibration read = ReadCalibration(folder / "c.json");
  WriteCalibration(folder / "d.json", read);
  EXPECT_EQ(ReadFile(folder / "c.json"), ReadFile(folder / "d.json"));
  EXPECT_EQ(read.camera.k2, 0.08);
  EXPECT_EQ(read.camera.camera_from_sample_rotation[4], -std::cos(0.2));
  EXPECT_EQ(read.channels[1].name, "638nm");
  EXPECT_EQ(read.channels[1].flux_scale_counts_mm2_sr_per_us, 1.0 / 3);
  EXPECT_EQ(read.scan_map, SomeCalibration().scan_map);
  EXPECT_EQ(read.dark.rate_counts_per_us, 1e-4);
  EXPECT_EQ(read.session_rig_hash, "abc");
}

TEST(CalibrationFile, TheFirstVersionIsStillRead) {
  const TempFolder folder;
  WriteCalibration(folder / "c.json", SomeCalibration());
  Json json = ReadJson(folder / "c.json");
  json["format_version"] = 1;
  for (const char* key : {"corrections",
                          "diagnostics",
                          "dark_offset_sigma_counts",
                          "dark_rate_sigma_counts_per_us",
                          "gain_sigma_electrons_per_count",
                          "read_noise_sigma_electrons",
                          "focal_sigma_px",
                          "centre_sigma_px",
                          "height_sigma_mm",
                          "laser_map_held_out_rms_mm"}) {
    EXPECT_EQ(json.erase(key), 1U) << key;
  }
  for (Json& channel : json["channels"]) {
    channel.erase("flux_scale_sigma");
  }
  WriteJson(folder / "c.json", json);
  const Calibration read = ReadCalibration(folder / "c.json");
  EXPECT_EQ(read.channels[0].flux_scale_counts_mm2_sr_per_us, 700.25);
  EXPECT_EQ(read.channels[0].flux_scale_sigma, 0);
  EXPECT_TRUE(read.corrections.glare.empty());
  EXPECT_TRUE(read.corrections.filters.mosaic.empty());
  EXPECT_EQ(read.corrections.linearity.Linear(1000), 1000);
  EXPECT_EQ(read.corrections.flat_field.At(0.5, 0.5), 1);
}

TEST(CalibrationFile, FiltersSurviveAndAreChecked) {
  const TempFolder folder;
  Calibration calibration = SomeCalibration();
  calibration.corrections.filters = {
      .mosaic = "GBRG", .white = {0.5, 1, 0.6}, .lasers = {{1, 0.1, 0}, {0.2, 1, 0.3}}};
  WriteCalibration(folder / "c.json", calibration);
  const Calibration read = ReadCalibration(folder / "c.json");
  EXPECT_EQ(read.corrections.filters.mosaic, "GBRG");
  EXPECT_EQ(read.corrections.filters.white, calibration.corrections.filters.white);
  EXPECT_EQ(read.corrections.filters.lasers, calibration.corrections.filters.lasers);
  const Json whole = ReadJson(folder / "c.json");
  const std::pair<const char*, Json> bad[] = {{"mosaic", "RGRG"},
                                              {"white", {0.5, 1}},
                                              {"white", {0.5, 1.5, 1}},
                                              {"lasers", {{1, 0.1, 0}}},
                                              {"lasers", {{1, 0, 0}, {0, 0, 0}}}};
  for (const auto& [key, value] : bad) {
    Json json = whole;
    json["corrections"]["filters"][key] = value;
    WriteJson(folder / "d.json", json);
    EXPECT_THAT(testing::ErrorMessage([&] { ReadCalibration(folder / "d.json"); }),
                HasSubstr("'" + std::string(key) + "'"))
        << value;
  }
}

TEST(CalibrationFile, TruncatedAnywhereIsBadData) {
  const TempFolder folder;
  WriteCalibration(folder / "c.json", SomeCalibration());
  const std::string text = ReadFile(folder / "c.json");
  for (std::size_t length = 0; length + 2 < text.size(); length += 37) {
    WriteFile(folder / "d.json", text.substr(0, length));
    EXPECT_THROW(ReadCalibration(folder / "d.json"), Error) << length;
  }
}

TEST(CalibrationFile, EachFieldIsNeededAndNamed) {
  const TempFolder folder;
  WriteCalibration(folder / "c.json", SomeCalibration());
  const Json whole = ReadJson(folder / "c.json");
  for (const auto& [key, value] : whole.items()) {
    Json json = whole;
    json.erase(key);
    WriteJson(folder / "d.json", json);
    try {
      ReadCalibration(folder / "d.json");
      ADD_FAILURE() << "read without " << key;
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ExitCode::kBadData);
      EXPECT_THAT(e.what(), HasSubstr("'" + key + "'"));
    }
  }
  for (const auto& [key, value] : whole.at("camera").items()) {
    Json json = whole;
    json["camera"].erase(key);
    WriteJson(folder / "d.json", json);
    EXPECT_THROW(ReadCalibration(folder / "d.json"), Error) << key;
  }
}

struct BadValue {
  const char* pointer;
  Json value;
  const char* message;
};

class CalibrationFileErrors : public ::testing::TestWithParam<BadValue> {};

TEST_P(CalibrationFileErrors, NameTheField) {
  const TempFolder folder;
  WriteCalibration(folder / "c.json", SomeCalibration());
  Json json = ReadJson(folder / "c.json");
  json[Json::json_pointer(GetParam().pointer)] = GetParam().value;
  WriteJson(folder / "c.json", json);
  try {
    ReadCalibration(folder / "c.json");
    FAIL();
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), HasSubstr(GetParam().message));
  }
}

INSTANTIATE_TEST_SUITE_P(
    All,
    CalibrationFileErrors,
    ::testing::Values(
        BadValue{"/format", "other", "not a calibration"},
        BadValue{"/format_version", 99, "format version 99; this build reads 1 to 2"},
        BadValue{"/gain_electrons_per_count", 0, "'gain_electrons_per_count': 0 makes"},
        BadValue{"/read_noise_electrons", -1, "'read_noise_electrons': -1 makes"},
        BadValue{"/dark_offset_counts", nullptr, "'dark_offset_counts'"},
        BadValue{"/channels", Json::array(), "'channels' is empty"},
        BadValue{
            "/channels/0/flux_scale_counts_mm2_sr_per_us", -5, "-5 makes no sense"},
        BadValue{"/camera/width_px", 0, "'width_px': 0 makes no sense"},
        BadValue{"/camera/camera_from_sample_rotation",
                 Json{1, 2, 3},
                 "must hold 9 finite numbers"},
        BadValue{"/camera/camera_from_sample_rotation",
                 Json{2, 0, 0, 0, 1, 0, 0, 0, 1},
                 "is no rotation"},
        BadValue{"/camera/camera_from_sample_translation_mm",
                 Json{0, 0, -5},
                 "behind the camera"}));

}  // namespace
}  // namespace nacre::calibrate
