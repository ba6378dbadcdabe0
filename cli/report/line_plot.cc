#include "cli/report/line_plot.h"

#include "cli/report/html.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>

namespace nacre::cli::report {
namespace {

constexpr double kLeft = 62;
constexpr double kRight = 14;
constexpr double kTop = 26;
constexpr double kBottom = 44;

struct Axis {
  bool is_log = false;
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
  double begin = 0;  // pixels
  double end = 1;

  bool Shows(double value) const {
    return std::isfinite(value) && (!is_log || value > 0);
  }
  void Include(double value) {
    if (Shows(value)) {
      low = std::min(low, value);
      high = std::max(high, value);
    }
  }
  void Finish(bool from_zero) {
    if (!(low <= high)) {
      low = is_log ? 0.1 : 0;
      high = 1;
    }
    if (is_log) {
      low = std::pow(10, std::floor(std::log10(low) * 2) / 2);
      high = std::pow(10, std::ceil(std::log10(high) * 2) / 2);
      if (low == high) {
        high *= 10;
      }
      return;
    }
    if (from_zero) {
      low = std::min(low, 0.0);
    }
    if (low == high) {
      high = low + (low == 0 ? 1 : std::abs(low));
    }
  }
  double Place(double value) const {
    const double t = is_log
                         ? std::log(std::max(value, low) / low) / std::log(high / low)
                         : (value - low) / (high - low);
    return begin + t * (end - begin);
  }
};

std::string TickLabel(double value, bool is_log) {
  if (is_log) {
    const double exponent = std::round(std::log10(value));
    if (exponent >= -2 && exponent <= 3) {
      return fmt::format("{:g}", value);
    }
    return fmt::format("10<tspan dy=\"-5\" font-size=\"9\">{}{:.0f}</tspan>",
                       exponent < 0 ? "−" : "",
                       std::abs(exponent));
  }
  return fmt::format("{}{:g}", value < 0 ? "−" : "", std::abs(value));
}

std::vector<double> TicksOf(const Axis& axis) {
  if (!axis.is_log) {
    return LinearTicks(axis.low, axis.high, 5);
  }
  std::vector<double> ticks;
  for (double e = std::ceil(std::log10(axis.low) - 1e-9);
       e <= std::log10(axis.high) + 1e-9;
       e += 1) {
    ticks.push_back(std::pow(10, e));
  }
  if (ticks.size() < 2) {  // within one decade: 1, 2, 5
    ticks.clear();
    for (double e = std::floor(std::log10(axis.low)); e <= std::log10(axis.high);
         e += 1) {
      for (const double digit : {1.0, 2.0, 5.0}) {
        const double tick = digit * std::pow(10, e);
        if (tick >= axis.low * (1 - 1e-9) && tick <= axis.high * (1 + 1e-9)) {
          ticks.push_back(tick);
        }
      }
    }
  }
  return ticks;
}

std::string Points(const Axis& x, const Axis& y, const Series& series) {
  std::string path;
  for (std::size_t n = 0; n < series.x.size(); ++n) {
    if (y.Shows(series.y[n])) {
      path += fmt::format("{}{:.1f},{:.1f}",
                          path.empty() ? "M" : " L",
                          x.Place(series.x[n]),
                          y.Place(series.y[n]));
    }
  }
  return path;
}

std::string Band(const Axis& x, const Axis& y, const Series& series) {
  std::string path;
  const auto add = [&](double at, double value) {
    path += fmt::format(
        "{}{:.1f},{:.1f}", path.empty() ? "M" : " L", x.Place(at), y.Place(value));
  };
  for (std::size_t n = 0; n < series.high.size(); ++n) {
    add(series.x[n], series.high[n]);
  }
  for (std::size_t n = series.low.size(); n-- > 0;) {
    add(series.x[n], series.low[n]);
  }
  return path.empty()
             ? path
             : fmt::format(
                   "<path class=\"band\" d=\"{} Z\" style=\"fill:var(--s{})\"/>\n",
                   path,
                   series.color);
}

std::string AxesSvg(const Axis& x, const Axis& y, const PlotOptions& options) {
  std::string svg;
  for (const double tick : TicksOf(y)) {
    svg += fmt::format(
        "<line class=\"tick\" x1=\"{0:.1f}\" x2=\"{1:.1f}\" y1=\"{2:.1f}\" "
        "y2=\"{2:.1f}\"/>"
        "<text x=\"{3:.1f}\" y=\"{4:.1f}\" text-anchor=\"end\">{5}</text>\n",
        x.begin,
        x.end,
        y.Place(tick),
        x.begin - 7,
        y.Place(tick) + 4,
        TickLabel(tick, y.is_log));
  }
  for (const double tick : TicksOf(x)) {
    svg += fmt::format(
        "<line class=\"axis\" x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1:.1f}\" "
        "y2=\"{2:.1f}\"/>"
        "<text x=\"{0:.1f}\" y=\"{3:.1f}\" text-anchor=\"middle\">{4}</text>\n",
        x.Place(tick),
        y.begin,
        y.begin + 4,
        y.begin + 18,
        TickLabel(tick, false));
  }
  svg += fmt::format(
      "<path class=\"axis\" d=\"M{:.1f},{:.1f} H{:.1f}\"/>\n", x.begin, y.begin, x.end);
  svg += fmt::format(
      "<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"end\">{}</text>"
      "<text x=\"4\" y=\"14\">{}</text>\n",
      x.end,
      y.begin + 38,
      options.x_label,
      options.y_label);
  return svg;
}

}  // namespace

std::vector<double> LinearTicks(double low, double high, int wanted) {
  const double rough = (high - low) / wanted;
  const double decade = std::pow(10, std::floor(std::log10(rough)));
  double step = 10 * decade;
  for (const double nice : {1.0, 2.0, 5.0}) {
    if (nice * decade >= rough * 0.999) {
      step = nice * decade;
      break;
    }
  }
  std::vector<double> ticks;
  for (double n = std::ceil(low / step - 1e-9); n * step <= high + 1e-9 * step;
       n += 1) {
    ticks.push_back(n * step);
  }
  return ticks;
}

std::string LinePlot(const std::vector<Series>& series, const PlotOptions& options) {
  Axis x{.begin = kLeft, .end = options.width - kRight};
  Axis y{.is_log = options.log_y, .begin = options.height - kBottom, .end = kTop};
  for (const Series& s : series) {
    for (std::size_t n = 0; n < s.x.size(); ++n) {
      x.Include(s.x[n]);
      y.Include(s.y[n]);
    }
    for (std::size_t n = 0; n < s.low.size(); ++n) {
      y.Include(s.low[n]);
      y.Include(s.high[n]);
    }
  }
  x.Finish(false);
  y.Finish(options.y_from_zero);

  std::string svg = fmt::format(
      "<svg viewBox=\"0 0 {} {}\" role=\"img\">\n", options.width, options.height);
  svg += AxesSvg(x, y, options);
  for (const Series& s : series) {
    svg += Band(x, y, s);
  }
  double legend_x = x.end;
  for (std::size_t n = series.size(); n-- > 0;) {
    const Series& s = series[n];
    svg += fmt::format("<path class=\"curve\" d=\"{}\" style=\"stroke:var(--s{})\"/>\n",
                       Points(x, y, s),
                       s.color);
    if (options.markers) {
      for (std::size_t k = 0; k < s.x.size(); ++k) {
        if (y.Shows(s.y[k])) {
          svg += fmt::format(
              "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3.2\" "
              "style=\"fill:var(--s{})\"/>\n",
              x.Place(s.x[k]),
              y.Place(s.y[k]),
              s.color);
        }
      }
    }
    if (!s.name.empty()) {
      const double text_width = 7.2 * static_cast<double>(s.name.size());
      svg += fmt::format(
          "<path class=\"curve\" d=\"M{0:.1f},10 h16\" style=\"stroke:var(--s{1})\"/>"
          "<text x=\"{2:.1f}\" y=\"14\">{3}</text>\n",
          legend_x - text_width - 21,
          s.color,
          legend_x - text_width,
          Escape(s.name));
      legend_x -= text_width + 36;
    }
  }
  return svg + "</svg>";
}

}  // namespace nacre::cli::report
