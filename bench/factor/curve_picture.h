#pragma once

#include <string>
#include <utility>
#include <vector>

namespace nacre::bench {

struct Curve {
  std::string name;
  std::string color;
  bool is_dashed = false;
  std::vector<std::pair<double, double>> points;
};

/// Curves over common axes; a logarithmic y axis, and x as told.
struct CurvePanel {
  std::string title;
  std::string x_label;
  bool log_x = true;
  std::vector<Curve> curves;
};

/// An SVG of panels, `columns` in a row, with a legend of all names below.
std::string CurvePicture(const std::vector<CurvePanel>& panels, int columns);

}  // namespace nacre::bench
