// [illuminator.device] and [safety]: the template is right, and what is wrong is said.

#include "acquire/rig_light.h"

#include "core/atomic_file.h"
#include "tests/support/error_message.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace nacre::testing {
namespace {

using ::testing::HasSubstr;

std::string Template() {
  return ReadFile(NACRE_RIGS_FOLDER "/gige-helios.toml", 1 << 20);
}

// What is said of the template with one text replaced.
std::string Message(const std::string& from, const std::string& to) {
  std::string text = Template();
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  text.replace(at, from.size(), to);
  return ErrorMessage([&] { acquire::ParseRig(text, "rig.toml"); });
}

TEST(RigLight, TheTemplateIsRight) {
  const acquire::RigDescription rig = acquire::ParseRig(Template(), "rig.toml");
  ASSERT_TRUE(rig.illuminator.has_value());
  EXPECT_EQ(rig.illuminator->device.name, "Helios 12345");
  const acquire::SpotTiming timing = acquire::PlanSpots(rig);
  EXPECT_EQ(timing.slots, 25);
  EXPECT_EQ(timing.cycle_points, 400);
}

TEST(RigLight, EachErrorNamesItsLine) {
  EXPECT_THAT(Message("max_angle_deg = 8.0", "max_angle_deg = 80"),
              ::testing::AllOf(HasSubstr("rig.toml:"), HasSubstr("max_angle_deg")));
  EXPECT_THAT(Message("[0.3, 0.3, 0.3]", "[0.3, 0.3]"),
              HasSubstr("2 values for 3 channels"));
  EXPECT_THAT(Message("[0.3, 0.3, 0.3]", "0.4"), HasSubstr("which is more"));
  EXPECT_THAT(Message("[-3.0, 3.0]", "[-3.0]"), HasSubstr("the lesser first"));
  EXPECT_THAT(Message("[-3.0, 3.0]", "[-3.0, 9.0]"), HasSubstr("goes beyond"));
  EXPECT_THAT(Message("[-3.0, 3.0]", "[-3.0, 1.0]"), HasSubstr("the grid asks for"));
  EXPECT_THAT(Message("max_dwell_us = 600", "max_dwell_us = 400"),
              HasSubstr("a dwell of 450 us"));
  EXPECT_THAT(Message("max_duty = 0.03", "max_duty = 0.02"), HasSubstr("0.0225"));
  EXPECT_THAT(Message("settle_us = 300", "settle_us = 1000"),
              HasSubstr("a shorter time to settle"));
  EXPECT_THAT(Message("80000, 20000]", "80000, 2000]"), HasSubstr("2000 us in common"));
  EXPECT_THAT(Message("\n[safety]", "\n[safely]"), HasSubstr("there is no [safety]"));
  EXPECT_THAT(Message("settle_us = 300", "setle_us = 300"), HasSubstr("setle_us"));
  EXPECT_EQ(Message("settle_us = 300", "kind = \"helios\""), "no error");
}

}  // namespace
}  // namespace nacre::testing
