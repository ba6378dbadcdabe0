#include "bench/factor/curve_picture.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <map>
#include <utility>

namespace nacre::bench {
namespace {

constexpr double kWidth = 400;
constexpr double kHeight = 300;
constexpr double kLeft = 58;
constexpr double kRight = 14;
constexpr double kTop = 30;
constexpr double kBottom = 42;

struct Axis {
  double low = 0;
  double high = 1;
  bool is_log = false;

  double Place(double value) const {
    return is_log ? std::log(value / low) / std::log(high / low)
                  : (value - low) / (high - low);
  }
  // 1, 2 and 5 times powers of ten, or whole numbers.
  std::vector<double> Ticks() const {
    std::vector<double> ticks;
    if (!is_log) {
      const double step = std::max(1.0, std::ceil((high - low) / 8));
      for (double at = std::ceil(low); at <= high; at += step) {
        ticks.push_back(at);
      }
      return ticks;
    }
    const bool fine = high / low < 300;
    for (int decade = -8; decade <= 10; ++decade) {
      for (const double digit : {1.0, 2.0, 5.0}) {
        const double tick = digit * std::pow(10.0, decade);
        if ((fine || digit == 1) && tick >= low && tick <= high) {
          ticks.push_back(tick);
        }
      }
    }
    return ticks;
  }
};

Axis AxisOf(const CurvePanel& panel, bool is_x) {
  Axis axis{1e300, -1e300, is_x ? panel.log_x : true};
  for (const Curve& curve : panel.curves) {
    for (const auto& [x, y] : curve.points) {
      axis.low = std::min(axis.low, is_x ? x : y);
      axis.high = std::max(axis.high, is_x ? x : y);
    }
  }
  if (axis.is_log) {
    axis.low *= 0.9;
    axis.high *= 1.1;
  } else {
    axis.low -= 0.5;
    axis.high += 0.5;
  }
  return axis;
}

std::string Text(double x, double y, const char* anchor, const std::string& text) {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\">{}</text>\n",
                     x,
                     y,
                     anchor,
                     text);
}

std::string Line(double x0, double y0, double x1, double y1, const char* color) {
  return fmt::format(
      "<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"{}\"/>\n",
      x0,
      y0,
      x1,
      y1,
      color);
}

std::string Draw(const CurvePanel& panel, double left, double top) {
  const Axis x = AxisOf(panel, true);
  const Axis y = AxisOf(panel, false);
  const double width = kWidth - kLeft - kRight;
  const double height = kHeight - kTop - kBottom;
  const auto px = [&](double value) { return left + kLeft + x.Place(value) * width; };
  const auto py = [&](double value) {
    return top + kTop + (1 - y.Place(value)) * height;
  };
  const double bottom = top + kTop + height;
  std::string svg = fmt::format(
      "<text x=\"{:.1f}\" y=\"{:.1f}\" font-weight=\"bold\">"
      "{}</text>\n",
      left + kLeft,
      top + kTop - 8,
      panel.title);
  for (const double tick : x.Ticks()) {
    svg += Line(px(tick), top + kTop, px(tick), bottom, "#e4e4e4");
    svg += Text(px(tick), bottom + 14, "middle", fmt::format("{:g}", tick));
  }
  for (const double tick : y.Ticks()) {
    svg += Line(left + kLeft, py(tick), left + kLeft + width, py(tick), "#e4e4e4");
    svg += Text(left + kLeft - 5, py(tick) + 4, "end", fmt::format("{:g}", tick));
  }
  svg += Text(left + kLeft + width / 2, bottom + 30, "middle", panel.x_label);
  for (const Curve& curve : panel.curves) {
    std::string line;
    for (const auto& [at, value] : curve.points) {
      line += fmt::format("{:.1f},{:.1f} ", px(at), py(value));
      svg +=
          fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"2.5\" fill=\"{}\"/>\n",
                      px(at),
                      py(value),
                      curve.color);
    }
    svg += fmt::format(
        "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" "
        "stroke-width=\"1.6\"{}/>\n",
        line,
        curve.color,
        curve.is_dashed ? " stroke-dasharray=\"5 3\"" : "");
  }
  return svg;
}

// Every name once, in the order it first comes in.
std::string Legend(const std::vector<CurvePanel>& panels, double top, double width) {
  std::string svg;
  std::map<std::string, bool> seen;
  double x = kLeft;
  double y = top + 16;
  for (const CurvePanel& panel : panels) {
    for (const Curve& curve : panel.curves) {
      if (std::exchange(seen[curve.name], true)) {
        continue;
      }
      const double size = 50 + 6.3 * static_cast<double>(curve.name.size());
      if (x + size > width) {
        x = kLeft;
        y += 18;
      }
      svg += fmt::format(
          "<line x1=\"{0:.1f}\" y1=\"{1:.1f}\" x2=\"{2:.1f}\" "
          "y2=\"{1:.1f}\" stroke=\"{3}\" stroke-width=\"2.5\"{4}/>\n",
          x,
          y - 4,
          x + 24,
          curve.color,
          curve.is_dashed ? " stroke-dasharray=\"5 3\"" : "");
      svg += Text(x + 30, y, "start", curve.name);
      x += size;
    }
  }
  return svg;
}

}  // namespace

std::string CurvePicture(const std::vector<CurvePanel>& panels, int columns) {
  const auto rows = (static_cast<int>(panels.size()) + columns - 1) / columns;
  const double width = kWidth * columns;
  const double height = kHeight * rows + 66;
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" "
      "viewBox=\"0 0 {0} {1}\" font-family=\"sans-serif\" font-size=\"11\">\n"
      "<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n",
      width,
      height);
  for (std::size_t n = 0; n < panels.size(); ++n) {
    const auto at = static_cast<int>(n);
    svg += Draw(panels[n], kWidth * (at % columns), kHeight * (at / columns));
  }
  return svg + Legend(panels, kHeight * rows, width) + "</svg>\n";
}

}  // namespace nacre::bench
