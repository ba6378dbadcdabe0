#pragma once

#include "core/error.h"

#include <gtest/gtest.h>

#include <functional>
#include <string>

namespace nacre::testing {

/// What the Error of `call` says, which has to have the code `expected`; "no error" if
/// nothing is thrown.
inline std::string ErrorMessage(const std::function<void()>& call,
                                ExitCode expected = ExitCode::kBadData) {
  try {
    call();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), expected);
    return e.what();
  }
  return "no error";
}

}  // namespace nacre::testing
