#pragma once

#include <string>
#include <vector>

namespace nacre::cli::report {

/// One curve, with a band around it if `low` and `high` aren't empty. Values that a log
/// axis can't show are left out.
struct Series {
  std::string name;  ///< plain text, beside the curve's end in the legend
  int color = 0;     ///< 0 to 5: --s0 to --s5 of the style sheet
  std::vector<double> x;
  std::vector<double> y;
  std::vector<double> low;
  std::vector<double> high;
};

struct PlotOptions {
  std::string x_label;  ///< SVG text markup
  std::string y_label;
  bool log_y = false;
  bool markers = false;      ///< dots at the points, for few of them
  bool y_from_zero = false;  ///< on a linear axis
  int width = 560;
  int height = 330;
};

/// An inline SVG with axes, round ticks and a legend, in the page's colours.
std::string LinePlot(const std::vector<Series>& series, const PlotOptions& options);

/// Round tick positions within [low, high], about `wanted` of them.
std::vector<double> LinearTicks(double low, double high, int wanted);

}  // namespace nacre::cli::report
