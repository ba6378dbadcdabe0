#include "cli/command.h"

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/version.h"
#include "tests/support/temp_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

namespace nacre::cli {
namespace {

using ::testing::HasSubstr;

TEST(Command, UsageErrorsAreTwo) {
  std::ostringstream out;
  ::testing::internal::CaptureStderr();
  EXPECT_EQ(RunCommand({}, out), 2);
  EXPECT_EQ(RunCommand({"factorise"}, out), 2);
  EXPECT_EQ(RunCommand({"inspect"}, out), 2);
  EXPECT_EQ(RunCommand({"inspect", "x", "--frobnicate"}, out), 2);
  EXPECT_THAT(::testing::internal::GetCapturedStderr(), HasSubstr("--help"));
}

TEST(Command, HelpNamesOptionsAndExitCodes) {
  std::ostringstream out;
  EXPECT_EQ(RunCommand({"--help"}, out), 0);
  EXPECT_THAT(out.str(), HasSubstr("75 interrupted and resumable"));
  std::ostringstream verb;
  EXPECT_EQ(RunCommand({"inspect", "--help"}, verb), 0);
  EXPECT_THAT(verb.str(), HasSubstr("--json"));
}

TEST(Command, PrintsItsVersion) {
  std::ostringstream out;
  EXPECT_EQ(RunCommand({"--version"}, out), 0);
  EXPECT_EQ(out.str(), "nacre " + Version() + "\n");
}

TEST(Command, ListsWhatItIsMadeOf) {
  std::ostringstream out;
  EXPECT_EQ(RunCommand({"--version", "--verbose"}, out), 0);
  EXPECT_THAT(out.str(), HasSubstr("OpenEXR "));
  EXPECT_THAT(out.str(), HasSubstr("Eigen 3"));
  EXPECT_THAT(out.str(), ::testing::ContainsRegex("\n/[^\n]*libOpenEXR[^\n]*\\.so"))
      << "the file itself, as it was loaded";
}

TEST(Command, BadDataSaysSo) {
  const testing::TempFolder folder;
  WriteFile(folder / "bad.rd.exr", "not an OpenEXR file");
  std::ostringstream out;
  try {
    RunCommand({"inspect", folder / "bad.rd.exr", "--quiet"}, out);
    FAIL() << "expected an error";
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::kBadData);
    EXPECT_THAT(e.what(), HasSubstr("bad.rd.exr"));
  }
}

}  // namespace
}  // namespace nacre::cli
