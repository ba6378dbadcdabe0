// Values below the glare's floor are marked, those above are left.

#include "reconstruct/internal/glare_floor.h"

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

RdHeader Header() {
  RdHeader header;
  header.points_x = 1;
  header.points_y = 1;
  header.core = 9;
  header.pitch_mm = 1;
  header.channels = {"R", "G"};
  return header;
}

TEST(GlareFloor, MarksWhatIsBelow) {
  const RdHeader header = Header();
  RdSlice slice = Falling(header);
  // Values are 10, 9, … 2, the mean of three in a row too, but at the rims.
  std::vector<float> floor(slice.rd.size(), 5.25F);
  EXPECT_EQ(MarkBelowFloor(header, floor, slice), 2 * 9 * 4);
  for (std::size_t k = 0; k < slice.rd.size(); ++k) {
    EXPECT_EQ(slice.valid[k], k % 9 < 5 ? 1 : 0);
  }
}

TEST(GlareFloor, ACellThatNoiseRaisedIsMarkedWithItsNeighbours) {
  const RdHeader header = Header();
  RdSlice slice = MakeSlice(header);
  slice.rd[40] = 8.5F;  // alone among zeros
  const std::vector<float> floor(slice.rd.size(), 1.0F);
  EXPECT_EQ(MarkBelowFloor(header, floor, slice), header.SliceSize());
}

TEST(GlareFloor, WithoutGlareNothingIsMarked) {
  const RdHeader header = Header();
  RdSlice slice = MakeSlice(header);
  slice.rd[3] = -1.0F;
  EXPECT_EQ(MarkBelowFloor(header, std::vector<float>(slice.rd.size(), 0.0F), slice),
            0);
  EXPECT_EQ(slice.valid[3], 1);
}

}  // namespace
}  // namespace nacre::reconstruct::internal
