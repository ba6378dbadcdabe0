// Figures of a calibration: residual vectors of camera and laser, the response curve,
// glare; and its warnings.

#include "cli/report/html.h"
#include "cli/report/line_plot.h"
#include "cli/report/sections.h"
#ifdef NACRE_HAS_CALIBRATE
#include "calibrate/calibration.h"
#endif

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>

namespace nacre::cli::report {

#ifdef NACRE_HAS_CALIBRATE
namespace {

using Arrows = std::vector<std::array<double, 4>>;

constexpr int kSide = 360;
constexpr int kMargin = 20;

// What is drawn, and how large.
struct Frame {
  double low_x = 1e300;
  double high_x = -1e300;
  double low_y = 1e300;
  double high_y = -1e300;
  double typical = 0;  // length of an arrow

  explicit Frame(const Arrows& arrows) {
    std::vector<double> lengths;
    for (const auto& [x, y, dx, dy] : arrows) {
      low_x = std::min(low_x, x);
      high_x = std::max(high_x, x);
      low_y = std::min(low_y, y);
      high_y = std::max(high_y, y);
      lengths.push_back(std::hypot(dx, dy));
    }
    const auto middle = lengths.begin() + std::ssize(lengths) / 2;
    std::nth_element(lengths.begin(), middle, lengths.end());
    typical = std::max(*middle, 1e-12);
  }
  double Scale() const {
    return (kSide - 2 * kMargin) / std::max({high_x - low_x, high_y - low_y, 1e-12});
  }
};

// A dot where something was seen, a line towards how far it is off, and the scale of
// those lines. `y_down` as in pictures.
std::string ArrowMap(const Arrows& arrows, bool y_down, const std::string& unit) {
  const Frame frame(arrows);
  constexpr double kTypicalPx = 12;
  const double per_unit = kTypicalPx / frame.typical;
  std::string svg = fmt::format(
      R"svg(<svg viewBox="0 0 {0} {1}" width="{0}" height="{1}" role="img">)svg",
      kSide,
      kSide + 26);
  for (const auto& [x, y, dx, dy] : arrows) {
    const double u = kMargin + (x - frame.low_x) * frame.Scale();
    const double v =
        kMargin + (y_down ? y - frame.low_y : frame.high_y - y) * frame.Scale();
    svg += fmt::format(
        R"svg(<circle cx="{0:.1f}" cy="{1:.1f}" r="1.3" fill="currentColor"/>)svg"
        R"svg(<line x1="{0:.1f}" y1="{1:.1f}" x2="{2:.1f}" y2="{3:.1f}" )svg"
        R"svg(stroke="var(--s0)" stroke-width="1.2"/>)svg",
        u,
        v,
        u + dx * per_unit,
        v + (y_down ? dy : -dy) * per_unit);
  }
  constexpr int kBarPx = static_cast<int>(3 * kTypicalPx);
  svg += fmt::format(
      R"svg(<line x1="{0}" y1="{1}" x2="{2}" y2="{1}" stroke="var(--s0)" )svg"
      R"svg(stroke-width="2"/><text x="{3}" y="{4}" font-size="12" )svg"
      R"svg(fill="currentColor">{5:.2g} {6}</text></svg>)svg",
      kMargin,
      kSide + 10,
      kMargin + kBarPx,
      kMargin + kBarPx + 8,
      kSide + 14,
      3 * frame.typical,
      unit);
  return svg;
}

std::string ResponseFigure(const calibrate::Diagnostics& diagnostics) {
  std::vector<std::array<double, 3>> points = diagnostics.response;
  std::sort(points.begin(), points.end());
  Series before;
  before.name = "as counted";
  Series after;
  after.name = "corrected";
  after.color = 1;
  // Means of runs: a curve, not a cloud.
  const std::size_t run = std::max<std::size_t>(1, points.size() / 40);
  for (std::size_t k = 0; k + run <= points.size(); k += run) {
    std::array<double, 3> mean{};
    for (std::size_t j = k; j < k + run; ++j) {
      for (std::size_t m = 0; m < 3; ++m) {
        mean[m] += points[j][m] / static_cast<double>(run);
      }
    }
    before.x.push_back(mean[0]);
    before.y.push_back(100 * mean[1]);
    after.x.push_back(mean[0]);
    after.y.push_back(100 * mean[2]);
  }
  PlotOptions options;
  options.x_label = "counts above dark";
  options.y_label = "off a straight line, %";
  options.width = 420;
  return Figure(LinePlot({before, after}, options),
                "Response: how counts of the white card differ from exposure times a "
                "rate, before and after the correction.");
}

std::string GlareFigure(const calibrate::Glare& glare) {
  Series density;
  density.name = "glare";
  for (std::size_t k = 0; k < glare.radius_px.size(); ++k) {
    constexpr double kLeast = 1e-12;
    density.x.push_back(std::log10(glare.radius_px[k]));
    density.y.push_back(glare.density_per_px2[k]);
    density.low.push_back(
        std::max(kLeast, glare.density_per_px2[k] - glare.sigma_per_px2[k]));
    density.high.push_back(glare.density_per_px2[k] + glare.sigma_per_px2[k]);
  }
  PlotOptions options;
  options.x_label = "log of distance in pixels";
  options.y_label = "share of a point's light, a pixel";
  options.log_y = true;
  options.markers = true;
  options.width = 420;
  return Figure(LinePlot({density}, options),
                fmt::format("Glare: {} ± {} of the light lands {} pixels and farther "
                            "from where it belongs.",
                            Percent(glare.fraction),
                            Percent(glare.fraction_sigma),
                            Number(glare.radius_px.front(), 2)));
}

}  // namespace

std::string CalibrationFigures(const std::filesystem::path& path) {
  const calibrate::Calibration c = calibrate::ReadCalibration(path);
  std::string body;
  for (const calibrate::Warning& warning : c.corrections.warnings) {
    body +=
        Check(false,
              "<strong>" + Escape(warning.name) + "</strong>: " + Escape(warning.text));
  }
  std::vector<std::string> maps;
  if (!c.diagnostics.corners_px.empty()) {
    maps.push_back(Figure(ArrowMap(c.diagnostics.corners_px, true, "px"),
                          "Reprojection: corners of all boards in the picture, and "
                          "how far they are off the camera model."));
  }
  if (!c.diagnostics.spots_mm.empty()) {
    maps.push_back(Figure(
        ArrowMap(c.diagnostics.spots_mm, false, "mm"),
        fmt::format("Laser: spots of the lattice on the sample plane, and how far they "
                    "are off the laser map; {} mm rms where held out.",
                    Number(c.laser_map_held_out_rms_mm))));
  }
  std::vector<std::string> curves;
  if (!c.diagnostics.response.empty()) {
    curves.push_back(ResponseFigure(c.diagnostics));
  }
  if (!c.corrections.glare.empty()) {
    curves.push_back(GlareFigure(c.corrections.glare));
  }
  for (const std::vector<std::string>& row : {maps, curves}) {
    body += row.empty() ? "" : Row(row);
  }
  return body;
}

#else

std::string CalibrationFigures(const std::filesystem::path& /*not readable here*/) {
  return "";
}

#endif

}  // namespace nacre::cli::report
