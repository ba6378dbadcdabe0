#pragma once

#include "core/error.h"
#include "render/render.h"
#include "render/scene.h"

#include <gtest/gtest.h>

#include <functional>
#include <string>

namespace nacre::render::testing {

inline const char* const kDipole =
    R"(<subsurface type="dipole"><rgb name="sigmaS" value="1, 2, 3"/>
  <rgb name="sigmaA" value="0.05, 0.02, 0.01"/><float name="scale" value="5"/>
  </subsurface>)";

/// A scene with a small perspective sensor that looks from `origin` to `target`, and
/// `body`.
inline std::string SceneText(const std::string& body,
                             const std::string& origin = "0, 0, 5",
                             const std::string& target = "0, 0, 0",
                             int size = 8) {
  const std::string pixels = std::to_string(size);
  return R"(<scene version="0.6.0">
<sensor type="perspective">
  <float name="fov" value="20"/>
  <transform name="toWorld"><lookat origin=")" +
         origin + R"(" target=")" + target + R"(" up="0, 1, 0"/></transform>
  <sampler type="sobol"><integer name="sampleCount" value="16"/></sampler>
  <film type="hdrfilm">
    <integer name="width" value=")" +
         pixels + R"("/><integer name="height" value=")" + pixels + R"("/>
    <rfilter type="box"/>
  </film>
</sensor>
)" + body +
         "\n</scene>\n";
}

// Files may lie anywhere, as tests have their own folders.
inline Scene Parse(const std::string& xml,
                   const SceneOptions& options = {.allow_outside = true}) {
  return ParseScene(xml, "test.xml", ".", options);
}

/// What the reader says to `xml`, "no error" if nothing.
inline std::string ReaderError(const std::string& xml,
                               const SceneOptions& options = {.allow_outside = true}) {
  try {
    Parse(xml, options);
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::kBadData) << e.what();
    return e.what();
  }
  return "no error";
}

/// Mean and standard error of channel `c` over all pixels.
struct Statistics {
  double mean = 0;
  double standard_error = 0;
};
inline Statistics ChannelStatistics(const ExrPart& image, std::size_t c) {
  const std::size_t n = image.PixelCount();
  double sum = 0;
  double sum2 = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const double v = static_cast<double>(image.Channel(c)[i]);
    sum += v;
    sum2 += v * v;
  }
  const double count = static_cast<double>(n);
  const double mean = sum / count;
  const double variance = std::max(0.0, sum2 / count - mean * mean);
  return {mean, std::sqrt(variance / (count - 1))};
}

}  // namespace nacre::render::testing
