#include "tests/factor/expect.h"

#include <gtest/gtest.h>

namespace nacre::testing {

void ExpectNear(const std::vector<float>& a,
                const std::vector<float>& b,
                double bound) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t n = 0; n < a.size(); ++n) {
    ASSERT_NEAR(static_cast<double>(a[n]), static_cast<double>(b[n]), bound) << n;
  }
}

void ExpectReciprocal(const factor::Material& m) {
  const int radius = (m.core - 1) / 2;
  std::vector<float> window(static_cast<std::size_t>(m.WindowSize()));
  for (int c = 0; c < static_cast<int>(m.channels.size()); ++c) {
    for (int j = 0; j < m.points_y; ++j) {
      for (int i = 0; i < m.points_x; ++i) {
        m.EvaluateWindow(c, i, j, window.data());
        for (int v = 0; v < m.core; ++v) {
          for (int u = 0; u < m.core; ++u) {
            const float there = m.Evaluate(c, i, j, u, v);
            ASSERT_EQ(there, window[static_cast<std::size_t>(v * m.core + u)]);
            ASSERT_GE(there, 0);
            const int x = i + u - radius;
            const int y = j + v - radius;
            if (x >= 0 && y >= 0 && x < m.points_x && y < m.points_y) {
              ASSERT_EQ(there, m.Evaluate(c, x, y, m.core - 1 - u, m.core - 1 - v));
            }
          }
        }
      }
    }
  }
}

}  // namespace nacre::testing
