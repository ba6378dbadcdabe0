// Values below the glare's floor are marked, those above are left.

#include "reconstruct/internal/glare_floor.h"

#include "reconstruct/internal/exposure_advice.h"

#include <gtest/gtest.h>

#include <vector>

namespace nacre::reconstruct::internal {
namespace {

// One row of falling values, the same in all rows and both channels.
RdSlice Falling(const RdHeader& header) {
  RdSlice slice = MakeSlice(header);
  for (std::size_t k = 0; k < slice.rd.size(); ++k) {
    slice.rd[k] = 10.0F - static_cast<float>(k % 9);
  }
  return slice;
}

RdHeader FloorHeader() {
  RdHeader header;
  header.points_x = 1;
  header.points_y = 1;
  header.core = 9;
  header.pitch_mm = 1;
  header.channels = {"R", "G"};
  return header;
}

TEST(GlareFloor, MarksWhatIsBelow) {
  const RdHeader header = FloorHeader();
  RdSlice slice = Falling(header);
  // Values are 10, 9, … 2, the mean of three in a row too, but at the rims.
  std::vector<float> floor(slice.rd.size(), 5.25F);
  EXPECT_EQ(MarkBelowFloor(header, floor, slice), 2 * 9 * 4);
  for (std::size_t k = 0; k < slice.rd.size(); ++k) {
    EXPECT_EQ(slice.valid[k], k % 9 < 5 ? 1 : 0);
  }
}

TEST(GlareFloor, ACellThatNoiseRaisedIsMarkedWithItsNeighbours) {
  const RdHeader header = FloorHeader();
  RdSlice slice = MakeSlice(header);
  slice.rd[40] = 8.5F;  // alone among zeros
  const std::vector<float> floor(slice.rd.size(), 1.0F);
  EXPECT_EQ(MarkBelowFloor(header, floor, slice), header.SliceSize());
}

TEST(GlareFloor, WithoutGlareNothingIsMarked) {
  const RdHeader header = FloorHeader();
  RdSlice slice = MakeSlice(header);
  slice.rd[3] = -1.0F;
  EXPECT_EQ(MarkBelowFloor(header, std::vector<float>(slice.rd.size(), 0.0F), slice),
            0);
  EXPECT_EQ(slice.valid[3], 1);
}

// At 10 ms 4 counts are as noisy as the sensor; half of the values need a fourfold
// exposure, a quarter more than that.
TEST(ExposureAdvice, NamesAnExposureThatIsLongEnough) {
  calibrate::Calibration calibration;
  calibration.gain_electrons_per_count = 4;
  calibration.read_noise_electrons = 4;
  calibration.channels = {{.name = "R", .flux_scale_counts_mm2_sr_per_us = 1}};
  calibration.camera.camera_from_sample_translation_mm = {0, 0, -500};
  calibration.scan_map.half_width_mm = 1;
  calibration.scan_map.half_width_rad = 0.01;
  RdHeader header;
  header.points_x = header.points_y = 1;
  header.core = 5;
  header.pitch_mm = 1;
  header.channels = {"R"};
  const ExposureAdvice advice(calibration, header, {10000, 1000});
  const double sensor = calibration.VarianceCounts2(0);
  const double alike = sensor / (calibration.VarianceCounts2(1) - sensor) / 10000 *
                       calibration.RdPerRate(0, {0, 0}, {0, 0}, header.eta);
  RdSlice slice = MakeSlice(header);
  for (std::size_t k = 0; k < 25; ++k) {
    slice.rd[k] = static_cast<float>(alike * (k < 5 ? 1.1 : k < 18 ? 0.3 : 0.01));
  }
  slice.valid[24] = 0;
  const ExposureAdvice::Counts counts = advice.Look(slice);
  EXPECT_EQ(counts.valid, 24);
  EXPECT_EQ(counts.dim[1], 13);
  EXPECT_EQ(counts.dim[6], 6);
  const std::string text = advice.Warning(counts);
  EXPECT_NE(text.find("79 % of the values"), std::string::npos) << text;
  EXPECT_NE(text.find("40 ms beside"), std::string::npos) << text;
  EXPECT_NE(text.find("leave 25 %, for 50 % more"), std::string::npos) << text;
  EXPECT_EQ(advice.Warning({.valid = 100, .dim = {20}}), "");
}

}  // namespace
}  // namespace nacre::reconstruct::internal
