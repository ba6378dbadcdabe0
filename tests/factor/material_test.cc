#include "factor/material.h"

#include "core/error.h"
#include "tests/factor/synthetic.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace nacre::factor {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

TEST(Material, EvaluatesTheFormula) {
  const Material m = nacre::testing::MakeMaterial(1);
  std::vector<float> window(9);
  for (int c = 0; c < 3; ++c) {
    for (int j = 0; j < m.points_y; ++j) {
      for (int i = 0; i < m.points_x; ++i) {
        m.EvaluateWindow(c, i, j, window.data());
        for (int v = 0; v < 3; ++v) {
          for (int u = 0; u < 3; ++u) {
            const auto point = static_cast<std::size_t>(j * 5 + i);
            const auto channel = static_cast<std::size_t>(c);
            const std::size_t k = m.cluster[point];
            double s = 0;
            for (std::size_t t = 0; t < 2; ++t) {
              const std::size_t cell = static_cast<std::size_t>(v * 3 + u);
              s += static_cast<double>(m.f[(channel * 2 + t) * 20 + point]) *
                   static_cast<double>(m.h[((channel * 2 + k) * 2 + t) * 9 + cell]);
            }
            const double expected =
                static_cast<double>(m.row_scale[channel * 20 + point]) *
                std::max(0.0, m.a[channel] * (std::exp(s) - m.b[channel]));
            const float value = m.Evaluate(c, i, j, u, v);
            EXPECT_NEAR(static_cast<double>(value), expected, 2e-7 * m.a[channel] * 4);
            EXPECT_EQ(value, window[static_cast<std::size_t>(v * 3 + u)]);
          }
        }
      }
    }
  }
}

TEST(Material, CountsItsBytes) {
  Material m = nacre::testing::MakeMaterial(1);
  // f, h, row_scale as floats, a byte a point for the cluster.
  EXPECT_EQ(m.StorageBytes(), 4 * (120 + 108 + 60) + 20);
  m.cluster_count = 1;
  EXPECT_EQ(m.StorageBytes(), 4 * (120 + 108 + 60));
}

std::string Complaint(const Material& m) {
  try {
    Validate(m, "here.exr");
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::kBadData);
    return e.what();
  }
  return "none";
}

TEST(Material, ValidateNamesTheField) {
  const Material good = nacre::testing::MakeMaterial(2);
  EXPECT_EQ(Complaint(good), "none");
  Material m = good;
  m.core = 4;
  EXPECT_THAT(Complaint(m), AllOf(HasSubstr("here.exr"), HasSubstr("core: 4")));
  m = good;
  m.f.pop_back();
  EXPECT_THAT(Complaint(m), HasSubstr("f: 119 values where 120 are expected"));
  m = good;
  m.h[7] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(Complaint(m), HasSubstr("h: value 7 is nan"));
  m = good;
  m.row_scale[3] = -1;
  EXPECT_THAT(Complaint(m), HasSubstr("row_scale: value 3 is -1"));
  m = good;
  m.cluster[5] = 2;
  EXPECT_THAT(Complaint(m), HasSubstr("point 5 is in cluster 2 of 2"));
  m = good;
  m.b[1] = 0;
  EXPECT_THAT(Complaint(m), HasSubstr("b: 0"));
}

}  // namespace
}  // namespace nacre::factor
