#include "reconstruct/internal/child_process.h"

#include "core/error.h"
#include "core/write_all.h"
#include "tests/support/error_message.h"

#include <gmock/gmock.h>

#include <csignal>
#include <stdexcept>
#include <unistd.h>

namespace nacre::reconstruct::internal {
namespace {

using ::testing::HasSubstr;

std::string ChildMessage(const std::function<void(int)>& work,
                         ExitCode code = ExitCode::kBadData,
                         int most_seconds = 10) {
  return nacre::testing::ErrorMessage([&] { RunInChild("a.mat", most_seconds, work); },
                                      code);
}

TEST(ChildProcess, WhatItWritesIsGivenBack) {
  const auto file = RunInChild("a.mat", 10, [](int fd) {
    Expect(WriteAll(fd, "seen "), "memory");
    Expect(WriteAll(fd, "here"), "memory");
  });
  EXPECT_EQ(std::string(file->bytes().begin(), file->bytes().end()), "seen here");
}

TEST(ChildProcess, ItsErrorsAreOurs) {
  const auto bad = [](int fd) {
    Expect(WriteAll(fd, "a longer text than the message"), "memory");
    throw BadData("a.mat: no");
  };
  EXPECT_EQ(ChildMessage(bad), "a.mat: no");
  const auto bug = [](int) { throw std::logic_error("odd"); };
  EXPECT_EQ(ChildMessage(bug, ExitCode::kBug), "odd");
}

TEST(ChildProcess, ItsDeathIsAnError) {
  for (const int signal : {SIGSEGV, SIGABRT}) {
    const auto die = [signal](int) { std::raise(signal); };
    EXPECT_THAT(ChildMessage(die),
                HasSubstr("a.mat: the library that reads it died of it"));
  }
  const auto leave = [](int) { ::_exit(99); };
  EXPECT_THAT(ChildMessage(leave), HasSubstr("ended its process (exit code 99)"));
  const auto die = [](int) { std::raise(SIGKILL); };
  EXPECT_THAT(ChildMessage(die, ExitCode::kFailed), HasSubstr("want of memory"));
  const auto stop = [](int) { std::raise(SIGINT); };
  EXPECT_THAT(ChildMessage(stop, ExitCode::kInterrupted),
              HasSubstr("stopped on request"));
}

TEST(ChildProcess, ItsTimeIsLimited) {
  const auto go_on = [](int) {
    while (::getppid() != 0) {
    }
  };
  EXPECT_THAT(ChildMessage(go_on, ExitCode::kBadData, 1),
              HasSubstr("isn't read after 1 s"));
}

}  // namespace
}  // namespace nacre::reconstruct::internal
