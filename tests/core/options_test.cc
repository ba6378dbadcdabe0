#include "core/options.h"

#include "core/error.h"
#include "core/options_json.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace nacre {
namespace {

struct Sample {
  int terms = 10;
  double error = 0.1;

  template <class Self, class Visitor>
  static void Visit(Self& self, Visitor&& visit) {
    visit("terms", self.terms, Range{1, 64}, "terms a channel");
    visit("error", self.error, Range{0, 1}, "relative");
  }
};

TEST(Options, ErrorNamesOptionValueAndRange) {
  Validate(Sample{});
  try {
    Validate(Sample{.terms = 65, .error = 0.1});
    FAIL() << "expected an error";
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::kUsage);
    EXPECT_STREQ(e.what(), "option terms is 65, but must lie in [1, 64]");
  }
  EXPECT_THROW(Validate(Sample{.terms = 1, .error = std::nan("")}), Error);
}

TEST(Options, BecomeJson) {
  EXPECT_EQ(OptionsToJson(Sample{}).dump(), R"({"terms":10,"error":0.1})");
}

TEST(Expect, NamesTheCaller) {
  try {
    Expect(false, "the impossible");
    FAIL() << "expected an error";
  } catch (const LogicError& e) {
    EXPECT_THAT(e.what(), ::testing::HasSubstr("options_test.cc"));
  }
}

}  // namespace
}  // namespace nacre
