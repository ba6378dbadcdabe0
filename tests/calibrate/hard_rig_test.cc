// Calibration of the shipped hard rig, with a seed of the test's own: every defect of
// the twins is on. What is found is compared to what the rig file says.

#include "acquire/capture.h"
#include "calibrate/calibrate.h"
#include "calibrate/glare.h"
#include "calibrate/session_state.h"
#include "core/atomic_file.h"
#include "rigs/optics.h"
#include "rigs/simulated_rig.h"
#include "tests/support/temp_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

namespace nacre::calibrate {
namespace {

using testing::TempFolder;

constexpr double kPitchMm = 1.96875;
constexpr int kSidePx = 272;

// Captured once for all that is asked of it, on a coarser grid: that shows drift and
// plane as well.
class HardRig : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TempFolder;
    const std::filesystem::path rigs(NACRE_RIGS_FOLDER);
    std::string text = ReadFile(rigs / "simulated-hard-chessboard.toml");
    const auto replace = [&](const std::string& from, const std::string& to) {
      const std::size_t at = text.find(from);
      ASSERT_NE(at, std::string::npos) << from;
      text.replace(at, from.size(), to);
    };
    replace("points = [24, 24]\npitch_mm = 1.96875\ncore = 11",
            "points = [12, 12]\npitch_mm = 3.9375\ncore = 5");
    // Two hours, for a drift that shows.
    replace("picture_period_s = 3.0", "picture_period_s = 24.0");
    replace("spot_spacing_cells = 12", "spot_spacing_cells = 5\norder_seed = 3");
    replace("\"chessboard4x4-quick.toml\"",
            "\"" + (rigs / "chessboard4x4-quick.toml").string() + "\"");
    WriteFile(*folder_ / "rig.toml", text);
    rigs::SimulatedRig rig(*folder_ / "rig.toml", {.seed = 20261});
    auto session = acquire::SessionWriter::Create(
        *folder_ / "s",
        acquire::MakeManifest(
            rig.description(), rig.camera().Info(), rig.illuminator().Info(), 20261),
        false);
    const acquire::Devices devices{rig.camera(), rig.illuminator(), rig.stage()};
    acquire::CaptureCalibration(session, devices);
    {
      const acquire::SessionReader reader(*folder_ / "s");
      calibration_ = new Calibration(Calibrate(reader, {}));
    }
    acquire::CaptureGrid(session, devices, calibration_->scan_map);
  }
  static void TearDownTestSuite() {
    delete calibration_;
    delete folder_;
  }

  static TempFolder* folder_;
  static Calibration* calibration_;
  void GeometryIsWithinWhatIsAskedFor() const;
  void FluxScaleToAPercent() const;
  void SensorIsSeenThrough() const;
  void FlatFieldIsTheVignetting() const;
  void GlareIsFoundAndTakenBack() const;
  void LightNoiseAmbientAndHysteresis() const;
  void SpotIsLongAlongItsAxis() const;
  void DriftAndPlaneOfTheSession() const;
  void WarningsNameWhatIsAmiss() const;
  void CorrectionsSurviveTheFile() const;
  void AgeAloneIsNamed() const;
  void KnowsWhenItIsStale() const;

  const Corrections& corrections() const { return calibration_->corrections; }
};

TempFolder* HardRig::folder_ = nullptr;
Calibration* HardRig::calibration_ = nullptr;

rigs::Optics TrueOptics() {
  return rigs::Optics({.vignetting = 0.2,
                       .vignetting_shift = 0.1,
                       .defocus_sigma_px = 0.6,
                       .glare_fraction = 0.03},
                      kSidePx,
                      kSidePx);
}

void HardRig::GeometryIsWithinWhatIsAskedFor() const {
  EXPECT_LE(calibration_->reprojection_rms_px, 0.1);
  EXPECT_LE(calibration_->laser_map_held_out_rms_mm, 0.02 * kPitchMm);
  EXPECT_GT(calibration_->laser_map_held_out_rms_mm, 0);
  EXPECT_NEAR(calibration_->camera.fx_px,
              kSidePx * 600.0 / 82.0,
              5 * calibration_->focal_sigma_px + 2);
}

void HardRig::FluxScaleToAPercent() const {
  const std::vector<float> v = TrueOptics().vignetting();
  const double mean =
      std::accumulate(v.begin(), v.end(), 0.0) / static_cast<double>(v.size());
  // Electrons a µs and radiance, power, electrons a count.
  const std::array truth = {6.5 * 10 / 6, 7.0 * 8 / 6, 5.5 * 8 / 6};
  for (std::size_t c = 0; c < truth.size(); ++c) {
    const ChannelResponse& channel = calibration_->channels[c];
    EXPECT_NEAR(channel.flux_scale_counts_mm2_sr_per_us / (truth[c] * mean), 1, 0.01);
    EXPECT_GT(channel.flux_scale_sigma, 0);
    EXPECT_LT(channel.flux_scale_sigma, 0.005);
  }
}

void HardRig::SensorIsSeenThrough() const {
  EXPECT_NEAR(calibration_->gain_electrons_per_count, 6, 0.06);
  EXPECT_NEAR(calibration_->gain_electrons_per_count,
              6,
              5 * calibration_->gain_sigma_electrons_per_count + 0.03);
  EXPECT_NEAR(calibration_->read_noise_electrons, 5, 0.1);
  EXPECT_NEAR(corrections().row_noise_counts, 1.5 / 6, 0.03);
  EXPECT_NEAR(calibration_->dark.offset_counts, 64, 0.05);
  // A signal of c counts was c + a c² / full well before it bent, to first order.
  const double counts = 3000;
  const double full = 25000.0 / 6;
  const double s = full / 0.02 * (1 - std::sqrt(1 - 4 * 0.01 * counts / full));
  EXPECT_NEAR(corrections().linearity.Linear(counts) / s, 1, 0.001);
  // Five in 10⁴ of 74,000 pixels are hot; the coolest of those aren't found.
  EXPECT_NEAR(static_cast<double>(corrections().hot_pixels.size()), 37, 20);
  EXPECT_GT(corrections().blooming.reach_px, 0);
}

void HardRig::FlatFieldIsTheVignetting() const {
  const std::vector<float> v = TrueOptics().vignetting();
  const std::vector<float> found = corrections().flat_field.Map(kSidePx, kSidePx);
  const double mean =
      std::accumulate(v.begin(), v.end(), 0.0) / static_cast<double>(v.size());
  double square = 0;
  double n = 0;
  for (int y = 20; y < kSidePx - 20; ++y) {  // glare darkens the rim, rightly
    for (int x = 20; x < kSidePx - 20; ++x) {
      const auto k = static_cast<std::size_t>(y * kSidePx + x);
      const double off =
          static_cast<double>(found[k]) / (static_cast<double>(v[k]) / mean) - 1;
      square += off * off;
      n += 1;
    }
  }
  EXPECT_LT(std::sqrt(square / n), 0.006);
}

void HardRig::GlareIsFoundAndTakenBack() const {
  const rigs::Optics optics = TrueOptics();
  ASSERT_FALSE(corrections().glare.empty());
  for (const double r : {6.0, 10.0, 20.0, 40.0}) {
    EXPECT_NEAR(corrections().glare.DensityAt(r) / optics.GlareDensity(r), 1, 0.25)
        << r;
  }
  // A point, through the true lens and back.
  std::vector<float> picture(static_cast<std::size_t>(kSidePx) * kSidePx, 0.0F);
  const std::size_t centre = static_cast<std::size_t>(kSidePx / 2) * kSidePx + 120;
  picture[centre] = 1e6F;
  optics.Apply(picture);
  const std::vector<float> before = picture;
  RemoveGlare(corrections().glare, kSidePx, kSidePx, picture);
  for (const std::size_t away : {10U, 20U, 40U}) {
    EXPECT_LT(std::abs(picture[centre + away]), 0.25F * before[centre + away]) << away;
  }
}

void HardRig::LightNoiseAmbientAndHysteresis() const {
  EXPECT_NEAR(corrections().light_noise.ripple, 0.003, 0.001);
  EXPECT_NEAR(corrections().ambient.At(0, 0), 0.002 * 0.5 / 6, 2e-5);
  EXPECT_NEAR(corrections().hysteresis.x_rad, 5e-5, 1e-5);
  EXPECT_NEAR(corrections().hysteresis.y_rad, 5e-5, 1e-5);
}

void HardRig::SpotIsLongAlongItsAxis() const {
  ASSERT_EQ(corrections().spots.size(), 3U);
  const SpotProfile& spot = corrections().spots[0];
  // σ² = 0.12² times and over the aspect: the difference of the axes' variances, turned
  // by 30°. The camera leans by 12°, so that blur and pixels are longer along y on the
  // plane: blur's variance is 0.36 and a pixel's own 1/12 of its side squared.
  const double difference = 0.12 * 0.12 * (1.3 - 1 / 1.3);
  const double side_mm = 82.0 / kSidePx;
  const double lean = std::cos(12 * M_PI / 180);
  const double blur = side_mm * side_mm * (1 / (lean * lean) - 1) * (0.36 + 1.0 / 12);
  const double tolerance = 0.2 * difference;
  EXPECT_NEAR(
      spot.xx_mm2 - spot.yy_mm2, difference * std::cos(M_PI / 3) - blur, tolerance);
  EXPECT_NEAR(2 * spot.xy_mm2, difference * std::sin(M_PI / 3), tolerance);
}

void HardRig::DriftAndPlaneOfTheSession() const {
  const acquire::SessionReader session(*folder_ / "s");
  const SessionState state = ExamineSession(session, *calibration_);
  ASSERT_TRUE(state.has_patch);
  EXPECT_NEAR(state.drift_per_hour, 0.01, 5 * state.drift_sigma_per_hour);
  EXPECT_LT(state.drift_sigma_per_hour, 0.01);
  EXPECT_NEAR(state.patch_flux, 1, 0.15);
  const double slope = std::tan(0.5 * M_PI / 180);
  EXPECT_NEAR(state.plane.height_mm, 0.5, 0.05);
  EXPECT_NEAR(state.plane.slope_x, slope * std::cos(M_PI / 3), 0.003);
  EXPECT_NEAR(state.plane.slope_y, slope * std::sin(M_PI / 3), 0.003);
}

void HardRig::WarningsNameWhatIsAmiss() const {
  std::vector<std::string> names;
  for (const Warning& warning : corrections().warnings) {
    names.push_back(warning.name);
  }
  EXPECT_THAT(names,
              ::testing::ElementsAre("nonlinear-response",
                                     "hot-pixels",
                                     "row-noise",
                                     "blooming",
                                     "vignetting",
                                     "glare",
                                     "power-ripple",
                                     "mirror-hysteresis",
                                     "ambient-light"));
}

void HardRig::CorrectionsSurviveTheFile() const {
  WriteCalibration(*folder_ / "c.json", *calibration_);
  const Calibration read = ReadCalibration(*folder_ / "c.json");
  WriteCalibration(*folder_ / "d.json", read);
  EXPECT_EQ(ReadFile(*folder_ / "c.json"), ReadFile(*folder_ / "d.json"));
  EXPECT_EQ(read.corrections.hot_pixels.size(), corrections().hot_pixels.size());
  EXPECT_EQ(read.corrections.glare.density_per_px2,
            corrections().glare.density_per_px2);
}

// Simulated sessions are of no time, which their manifests can be given.
void HardRig::AgeAloneIsNamed() const {
  constexpr std::int64_t kThen = 1'780'000'000;
  constexpr std::int64_t kDay = 86400;
  const std::filesystem::path later = *folder_ / "later";
  std::filesystem::copy(
      *folder_ / "s", later, std::filesystem::copy_options::recursive);
  acquire::SessionManifest manifest = acquire::ReadManifest(later);
  EXPECT_FALSE(manifest.captured_unix_s.has_value());
  manifest.captured_unix_s = kThen + 40 * kDay;
  acquire::WriteManifest(later, manifest);
  const acquire::SessionReader session(later);
  Calibration calibration = *calibration_;
  EXPECT_TRUE(CompareAge(session, calibration, 30).empty());  // of no known time
  calibration.captured_unix_s = kThen;
  WriteCalibration(*folder_ / "dated.json", calibration);
  calibration = ReadCalibration(*folder_ / "dated.json");
  const std::vector<Warning> warnings = CompareAge(session, calibration, 30);
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_EQ(warnings[0].name, "stale-by-age");
  EXPECT_THAT(warnings[0].text, ::testing::HasSubstr("40.0 days before"));
  EXPECT_TRUE(CompareAge(session, calibration, 41).empty());
  calibration.captured_unix_s = kThen + 80 * kDay;
  EXPECT_THAT(CompareAge(session, calibration, 30).at(0).text,
              ::testing::HasSubstr("40.0 days after"));
}

void HardRig::KnowsWhenItIsStale() const {
  const acquire::SessionReader session(*folder_ / "s");
  EXPECT_TRUE(CompareWithSession(session, *calibration_).empty());
  Calibration other = *calibration_;
  other.dark.offset_counts += 2;
  other.scan_map.x_mm[0] += 0.3;
  other.channels[1].flux_scale_counts_mm2_sr_per_us *= 1.03;
  std::vector<std::string> names;
  for (const Warning& warning : CompareWithSession(session, other)) {
    names.push_back(warning.name);
  }
  EXPECT_THAT(names,
              ::testing::ElementsAre("stale-dark", "stale-geometry", "stale-flux"));
  AgeAloneIsNamed();
  other.corrections.filters.mosaic = "RGGB";
  const std::vector<Warning> of_another = CompareWithSession(session, other);
  ASSERT_EQ(of_another.size(), 1U);
  EXPECT_EQ(of_another[0].name, "other-rig");
}

// One test, as every test is a process of its own and would capture all of it again.
TEST_F(HardRig, IsCalibrated) {
  GeometryIsWithinWhatIsAskedFor();
  FluxScaleToAPercent();
  SensorIsSeenThrough();
  FlatFieldIsTheVignetting();
  GlareIsFoundAndTakenBack();
  LightNoiseAmbientAndHysteresis();
  SpotIsLongAlongItsAxis();
  DriftAndPlaneOfTheSession();
  WarningsNameWhatIsAmiss();
  CorrectionsSurviveTheFile();
  KnowsWhenItIsStale();
}

}  // namespace
}  // namespace nacre::calibrate
