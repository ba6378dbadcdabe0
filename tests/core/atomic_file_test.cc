#include "core/atomic_file.h"

#include "core/error.h"
#include "core/hash.h"
#include "core/json.h"
#include "tests/support/temp_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <sys/wait.h>
#include <unistd.h>

namespace nacre {
namespace {

using ::testing::HasSubstr;

int FilesIn(const std::filesystem::path& folder) {
  int count = 0;
  for ([[maybe_unused]] const auto& entry :
       std::filesystem::directory_iterator(folder)) {
    ++count;
  }
  return count;
}

TEST(AtomicFile, IsInvisibleUntilCommitted) {
  const testing::TempFolder folder;
  const auto path = folder / "a.txt";
  {
    AtomicFile file(path);
    std::ofstream(file.temporary_path()) << "half";
    EXPECT_FALSE(std::filesystem::exists(path));
  }
  EXPECT_EQ(FilesIn(folder.path()), 0) << "an abandoned file leaves nothing behind";
}

TEST(AtomicFile, ReplacesTheOldFileWhole) {
  const testing::TempFolder folder;
  const auto path = folder / "a.txt";
  WriteFile(path, "old");
  {
    AtomicFile file(path);
    std::ofstream(file.temporary_path()) << "new";
    EXPECT_EQ(ReadFile(path), "old");
    file.Commit();
  }
  EXPECT_EQ(ReadFile(path), "new");
  EXPECT_EQ(FilesIn(folder.path()), 1);
}

TEST(AtomicFile, RemovesWhatAKilledProcessLeftOfTheSameFile) {
  const testing::TempFolder folder;
  const pid_t child = ::fork();
  if (child == 0) {
    const AtomicFile file(folder / "a.txt");
    std::ofstream(file.temporary_path()) << "half";
    const AtomicFile other(folder / "b.txt");
    std::ofstream(other.temporary_path()) << "half";
    ::_exit(0);
  }
  ::waitpid(child, nullptr, 0);
  EXPECT_EQ(FilesIn(folder.path()), 2);
  const AtomicFile alive(folder / "a.txt");
  std::ofstream(alive.temporary_path()) << "this process' own";
  WriteFile(folder / "a.txt", "whole");
  EXPECT_EQ(FilesIn(folder.path()), 3) << "b's, the living process', and the file";
  EXPECT_TRUE(std::filesystem::exists(alive.temporary_path()));
}

TEST(AtomicFile, NamesTheMissingFolder) {
  const testing::TempFolder folder;
  try {
    WriteFile(folder / "missing" / "a.txt", "x");
    FAIL() << "expected an error";
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), HasSubstr("there is no folder"));
  }
}

TEST(ReadFile, RefusesMoreThanItsBound) {
  const testing::TempFolder folder;
  WriteFile(folder / "a", "12345");
  EXPECT_EQ(ReadFile(folder / "a", 5), "12345");
  EXPECT_THROW(ReadFile(folder / "a", 4), Error);
  EXPECT_THROW(ReadFile(folder / "b"), Error);
}

TEST(Hash, MatchesThePublishedVectorOfXxh3) {
  // XXH3_128bits("", seed 0), from the reference implementation's test vectors.
  EXPECT_EQ(HashHex("", 0), "99aa06d3014798d86001c324468d497f");
}

TEST(Hash, OfAFileIsThatOfItsBytes) {
  const testing::TempFolder folder;
  const std::string bytes(3'000'000, 'n');
  WriteFile(folder / "a", bytes);
  EXPECT_EQ(HashFile(folder / "a"), HashHex(bytes.data(), bytes.size()));
}

TEST(Json, NamesTheLineOfAnError) {
  try {
    ParseJson("{\n\"a\": 1,\n oops }", "x.json");
    FAIL() << "expected an error";
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::kBadData);
    EXPECT_THAT(e.what(), HasSubstr("x.json:3:"));
  }
}

TEST(Json, ANumberBeyondAllDoublesIsBadData) {
  try {
    ParseJson("[1e999]", "x.json");
    FAIL() << "expected an error";
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::kBadData);
    EXPECT_THAT(e.what(), HasSubstr("x.json: not valid JSON"));
  }
}

TEST(Json, NamesTheFieldThatIsMissingOrWrong) {
  const Json json = ParseJson(R"({"a": "text"})", "x.json");
  EXPECT_EQ(Get<std::string>(json, "a", "x.json"), "text");
  EXPECT_THROW(Get<double>(json, "a", "x.json"), Error);
  EXPECT_THROW(Get<double>(json, "b", "x.json"), Error);
}

}  // namespace
}  // namespace nacre
