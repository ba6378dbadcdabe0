#include "core/progress.h"

#include "core/error.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

namespace nacre {
namespace {

TEST(Progress, PartsAddUpToTheWhole) {
  std::vector<std::int64_t> done;
  const ProgressFunction whole = [&](const Progress& state) {
    EXPECT_EQ(state.total, 12);
    EXPECT_EQ(state.stage, "photons");
    done.push_back(state.done);
    return true;
  };
  for (int outer = 0; outer < 2; ++outer) {
    const ProgressFunction half = PartOf(whole, outer, 2);
    for (int inner = 0; inner < 3; ++inner) {
      Report(PartOf(half, inner, 3), {"photons", 1, 2, ""});
      Report(PartOf(half, inner, 3), {"photons", 2, 2, ""});
    }
  }
  EXPECT_EQ(done, (std::vector<std::int64_t>{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12}));
}

TEST(Progress, PartsOfNothingAreEmptyAndStoppingIsPassedOn) {
  EXPECT_FALSE(PartOf({}, 0, 2));
  const ProgressFunction stop = [](const Progress&) { return false; };
  EXPECT_THROW(Report(PartOf(stop, 1, 2), {"x", 1, 2, ""}), Error);
}

}  // namespace
}  // namespace nacre
