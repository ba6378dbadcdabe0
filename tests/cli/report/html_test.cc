#include "cli/report/html.h"

#include "cli/report/color_map.h"
#include "cli/report/line_plot.h"
#include "cli/report/raster.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

namespace nacre::cli::report {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(Html, EscapesWhatMarkupMeans) {
  EXPECT_EQ(Escape("<a href=\"x\">&"), "&lt;a href=&quot;x&quot;&gt;&amp;");
  EXPECT_EQ(Prose("R_d < 1"), "R<sub>d</sub> &lt; 1");
}

TEST(Html, Base64AsInTheStandard) {
  // RFC 4648, section 10.
  EXPECT_EQ(Base64(""), "");
  EXPECT_EQ(Base64("f"), "Zg==");
  EXPECT_EQ(Base64("fo"), "Zm8=");
  EXPECT_EQ(Base64("foo"), "Zm9v");
  EXPECT_EQ(Base64("foob"), "Zm9vYg==");
  EXPECT_EQ(Base64("fooba"), "Zm9vYmE=");
  EXPECT_EQ(Base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(Base64("\xff\xfe"), "//4=");
}

TEST(Html, NumbersKeepTheirDigits) {
  EXPECT_EQ(Number(0), "0");
  EXPECT_EQ(Number(1), "1.00");
  EXPECT_EQ(Number(12.345), "12.3");
  EXPECT_EQ(Number(-0.5), "−0.500");
  EXPECT_EQ(Number(123456), "123456");
  EXPECT_EQ(Number(1.2345e-7), "1.23 × 10<sup>−7</sup>");
  EXPECT_EQ(Number(std::numeric_limits<double>::quiet_NaN()), "–");
  EXPECT_EQ(Percent(0.01234), "1.23 %");
  EXPECT_EQ(Bytes(568), "568 B");
  EXPECT_EQ(Bytes(568320), "568 kB");
  EXPECT_EQ(Bytes(1.5e9), "1.50 GB");
}

TEST(LinePlot, TicksAreRound) {
  EXPECT_THAT(LinearTicks(0, 10, 5), ElementsAre(0, 2, 4, 6, 8, 10));
  EXPECT_THAT(LinearTicks(1, 4, 3), ElementsAre(1, 2, 3, 4));
  EXPECT_EQ(LinearTicks(-0.013, 0.021, 5).size(), 4u);  // −0.01, 0, 0.01, 0.02
}

TEST(LinePlot, LeavesOutWhatALogAxisCannotShow) {
  const std::string svg = LinePlot({{"c", 0, {0, 1, 2}, {1, 0, 10}, {}, {}}},
                                   {.x_label = "x", .y_label = "y", .log_y = true});
  EXPECT_THAT(svg, HasSubstr("</svg>"));
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
  EXPECT_THAT(svg, Not(HasSubstr("inf")));
}

TEST(LinePlot, ConstantAndEmptyCurvesAreDrawn) {
  for (const bool log_y : {false, true}) {
    const std::string flat = LinePlot({{"", 0, {1, 2}, {3, 3}, {}, {}}},
                                      {.x_label = "x", .y_label = "y", .log_y = log_y});
    EXPECT_THAT(flat, Not(HasSubstr("nan")));
    EXPECT_THAT(LinePlot({{"", 0, {}, {}, {}, {}}},
                         {.x_label = "x", .y_label = "y", .log_y = log_y}),
                Not(HasSubstr("nan")));
  }
}

// Lightness by which grey-scale prints and most colour-blind readers go.
int Luma(Rgb8 c) {
  return 299 * c[0] + 587 * c[1] + 114 * c[2];
}

TEST(ColorMap, SequentialRisesInLightness) {
  for (int n = 1; n <= 64; ++n) {
    EXPECT_GT(Luma(SequentialColor(n / 64.0)), Luma(SequentialColor((n - 1) / 64.0)));
  }
  EXPECT_EQ(SequentialColor(-1), SequentialColor(0));
  EXPECT_EQ(SequentialColor(std::numeric_limits<double>::quiet_NaN()),
            SequentialColor(0));
}

TEST(ColorMap, DivergingIsLightInTheMiddle) {
  EXPECT_GT(Luma(DivergingColor(0)), 900 * 255);
  EXPECT_GT(DivergingColor(1)[0], DivergingColor(1)[2]);    // red
  EXPECT_LT(DivergingColor(-1)[0], DivergingColor(-1)[2]);  // blue
}

TEST(Raster, ShrinkKeepsTheMean) {
  std::vector<float> values(40 * 20);
  for (std::size_t n = 0; n < values.size(); ++n) {
    values[n] = static_cast<float>(n % 7);
  }
  const OwnedPlane small = Shrink({40, 20, values}, 10);
  EXPECT_EQ(small.width, 10);
  EXPECT_EQ(small.height, 5);
  double all = 0;
  double shrunk = 0;
  for (const float value : values) {
    all += static_cast<double>(value) / 800;
  }
  for (const float value : small.values) {
    shrunk += static_cast<double>(value) / 50;
  }
  EXPECT_NEAR(shrunk, all, 1e-6);
}

TEST(Raster, LogImageSpansItsRange) {
  const std::vector<float> values{1e-4F, 1, -3, 1e-9F};
  const PngImage image = LogImage({4, 1, values}, 1e-4, 1);
  const Rgb8 dark = SequentialColor(0);
  const Rgb8 light = SequentialColor(1);
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_EQ(image.values[c], dark[c]);
    EXPECT_EQ(image.values[3 + c], light[c]);
    EXPECT_EQ(image.values[6 + c], dark[c]);
    EXPECT_EQ(image.values[9 + c], dark[c]);
  }
}

}  // namespace
}  // namespace nacre::cli::report
