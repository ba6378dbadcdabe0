#include "cli/report/dataset_digest.h"
#include "cli/report/html.h"
#include "cli/report/line_plot.h"
#include "cli/report/raster.h"
#include "cli/report/sections.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace nacre::cli::report {
namespace {

using reconstruct::RdHeader;

Plane GridPlane(const RdHeader& header, const std::vector<float>& values) {
  return {header.points_x, header.points_y, values};
}

std::string Facts(const DatasetDigest& d) {
  const RdHeader& h = d.header;
  std::vector<Fact> facts{
      {"Points x<sub>i</sub>", fmt::format("{} × {}", h.points_x, h.points_y)},
      {"Sample area",
       fmt::format("{} × {} mm",
                   Number(h.points_x * h.pitch_mm),
                   Number(h.points_y * h.pitch_mm))},
      {"Window",
       fmt::format(
           "{0} × {0} cells, ±{1} mm", h.core, Number(h.Radius() * h.pitch_mm))},
      {"Pitch", Number(h.pitch_mm) + " mm"},
      {"Channels", Escape(fmt::format("{}", fmt::join(h.channels, ", ")))},
      {"Refractive index", Number(h.eta)},
      {"Measurements",
       Bytes(4.0 * static_cast<double>(h.PointCount() * h.SliceSize()))}};
  if (d.noise > 0) {
    facts.push_back({"Noise, rms over rms", Percent(d.noise)});
  }
  return FactList(facts);
}

// Marks where the shown slices lie, numbered.
std::string Marks(const DatasetDigest& d) {
  std::string svg = fmt::format("<svg viewBox=\"0 0 {} {}\" aria-hidden=\"true\">",
                                d.header.points_x,
                                d.header.points_y);
  const double unit = 0.01 * std::max(d.header.points_x, d.header.points_y);
  for (std::size_t n = 0; n < d.samples.size(); ++n) {
    const double x = d.samples[n].i + 0.5;
    const double y = d.samples[n].j + 0.5;
    const bool left = x > 0.85 * d.header.points_x;
    svg += fmt::format(
        "<g style=\"paint-order:stroke;stroke-linejoin:round\" stroke=\"#222\" "
        "stroke-width=\"{3}\" fill=\"#fff\"><circle cx=\"{0}\" cy=\"{1}\" r=\"{2}\"/>"
        "<text x=\"{4}\" y=\"{5}\" font-size=\"{6}\" font-weight=\"600\" "
        "text-anchor=\"{7}\" style=\"fill:#fff\">{8}</text></g>",
        x,
        y,
        1.1 * unit,
        0.9 * unit,
        x + (left ? -2.6 : 2.6) * unit,
        y + 2 * unit,
        5.8 * unit,
        left ? "end" : "start",
        n + 1);
  }
  return svg + "</svg>";
}

std::string AlbedoFigure(const DatasetDigest& d) {
  std::vector<Plane> planes;
  float largest = 0;
  for (const std::size_t c : PictureChannels(d.header.channels)) {
    planes.push_back(GridPlane(d.header, d.albedo[c]));
    for (const float value : d.albedo[c]) {
      largest = std::max(largest, value);
    }
  }
  const double gain = largest > 0 ? 1 / static_cast<double>(largest) : 1;
  return Figure(
      "<div class=\"over\">" +
          ImageTag(ColorImage(planes, gain), "albedo of the sample", "pixels") +
          Marks(d) + "</div>",
      fmt::format("The sample by its albedo Σ<sub>d</sub> R<sub>d</sub>, white "
                  "being {}; numbers mark the slices of the next figure.",
                  Number(static_cast<double>(largest))),
      "narrow");
}

std::string ProfileFigure(const DatasetDigest& d) {
  std::vector<Series> series;
  for (std::size_t c = 0; c < d.profiles.size(); ++c) {
    const RadialProfile& p = d.profiles[c];
    series.push_back({d.header.channels[c],
                      ChannelColor(d.header.channels[c], c),
                      p.radius_mm,
                      p.mean,
                      p.low,
                      p.high});
  }
  return Figure(
      LinePlot(series,
               {.x_label = "distance |d| (mm)",
                .y_label = "R<tspan dy=\"3\" font-size=\"9\">d</tspan><tspan "
                           "dy=\"-3\"> (mm⁻²)</tspan>",
                .log_y = true}),
      "Radial profile: mean over all slices, with the band that holds 80 % of "
      "them.");
}

std::string SliceFigure(const DatasetDigest& d) {
  constexpr double kDecades = 1e-4;
  const double peak = *std::max_element(d.peak.begin(), d.peak.end());
  if (!(peak > 0)) {
    return Check(false,
                 "No value of the dataset is positive: there is nothing to show.");
  }
  std::string grid = fmt::format(
      "<div class=\"grid\" style=\"grid-template-columns:auto "
      "repeat({},1fr)\">\n<span></span>",
      d.samples.size());
  for (std::size_t n = 0; n < d.samples.size(); ++n) {
    const PointMm p = d.header.GridPoint(d.samples[n].i, d.samples[n].j);
    grid +=
        fmt::format("<span>{}: ({}, {}) mm</span>", n + 1, Number(p.x), Number(p.y));
  }
  const auto window = static_cast<std::size_t>(d.header.WindowSize());
  for (std::size_t c = 0; c < d.header.channels.size(); ++c) {
    grid += "\n<span class=\"side\">" + Escape(d.header.channels[c]) + "</span>";
    for (const SampleSlice& slice : d.samples) {
      const Plane plane{
          d.header.core, d.header.core, {slice.rd.data() + c * window, window}};
      grid += ImageTag(LogImage(plane, kDecades * peak, peak),
                       fmt::format("slice ({}, {})", slice.i, slice.j),
                       "pixels");
    }
  }
  grid += "</div>\n" + ColorScale(Number(kDecades * peak) + " mm<sup>−2</sup>",
                                  Number(peak) + " mm<sup>−2</sup>",
                                  false);
  return Figure(
      grid,
      fmt::format("Slices R<sub>d</sub>(x<sub>i</sub>, ·), logarithmic; each is "
                  "{} mm wide, light enters at its centre.",
                  Number(d.header.core * d.header.pitch_mm)));
}

std::string EnergyTable(const DatasetDigest& d) {
  std::vector<std::vector<std::string>> rows;
  double largest = 0;
  for (std::size_t c = 0; c < d.albedo.size(); ++c) {
    const auto [low, high] =
        std::minmax_element(d.albedo[c].begin(), d.albedo[c].end());
    double sum = 0;
    for (const float value : d.albedo[c]) {
      sum += static_cast<double>(value);
    }
    largest = std::max(largest, static_cast<double>(*high));
    rows.push_back({Escape(d.header.channels[c]),
                    Number(static_cast<double>(*low)),
                    Number(sum / static_cast<double>(d.albedo[c].size())),
                    Number(static_cast<double>(*high)),
                    Number(d.peak[c]),
                    Percent(d.asymmetry[c]),
                    d.noise_asymmetry[c] > 0 ? Percent(d.noise_asymmetry[c]) : "–"});
  }
  std::string out = Table({"Channel",
                           "albedo, least",
                           "mean",
                           "largest",
                           "peak R<sub>d</sub> (mm<sup>−2</sup>)",
                           "asymmetry",
                           "of noise alone"},
                          rows);
  out +=
      Check(largest <= 1,
            largest <= 1
                ? fmt::format("No point returns more light than entered: the largest "
                              "albedo is {}.",
                              Number(largest))
                : fmt::format("Some point returns more light than entered: the largest "
                              "albedo is {}. Flux scale or dark level is wrong.",
                              Number(largest)));
  return out;
}

std::string ReciprocityCheck(const DatasetDigest& d) {
  if (d.pair_count == 0) {
    return Check(true, "No two points see each other: reciprocity can't be checked.");
  }
  double asymmetry = 0;
  double noise = 0;
  for (std::size_t c = 0; c < d.asymmetry.size(); ++c) {
    if (d.asymmetry[c] >= asymmetry) {
      asymmetry = d.asymmetry[c];
      noise = d.noise_asymmetry[c];
    }
  }
  // Real slabs, lit at right angles, are a little asymmetric; a rig's faults are more.
  const bool good = asymmetry < std::max(0.1, 1.5 * noise);
  return Check(
      good,
      fmt::format(
          "R<sub>d</sub>(x<sub>i</sub>, x<sub>o</sub>) and R<sub>d</sub>(x<sub>o"
          "</sub>, x<sub>i</sub>) differ by {} (rms over rms, {} pairs){}",
          Percent(asymmetry),
          Number(static_cast<double>(d.pair_count)),
          noise > 0 ? fmt::format("; the noise alone would give {}.", Percent(noise))
                    : "."));
}

std::string MapFigures(const DatasetDigest& d, const std::string& beside) {
  std::vector<std::string> figures;
  if (d.pair_count > 0) {
    const float high =
        *std::max_element(d.asymmetry_map.begin(), d.asymmetry_map.end());
    figures.push_back(Figure(
        ImageTag(
            LinearImage(
                GridPlane(d.header, d.asymmetry_map), 0, static_cast<double>(high)),
            "map of the asymmetry",
            "pixels") +
            ColorScale("0", Percent(static_cast<double>(high)), false),
        "Asymmetry of the pairs that a point is part of: even where only noise makes "
        "it, "
        "marked where the sample or the rig does.",
        "narrow"));
  }
  if (d.missing > 0) {
    figures.push_back(Figure(
        ImageTag(LinearImage(GridPlane(d.header, d.valid_fraction), 0, 1),
                 "map of validity",
                 "pixels") +
            ColorScale("0", "100 %", false),
        "Share of each window that was measured: windows at the rim reach beyond the "
        "picture or the lit field.",
        "narrow"));
  }
  figures.push_back("<div class=\"grow\">" + beside + "</div>");
  return Row(figures);
}

// By the verb that made it.
std::string TitleOf(const RdHeader& header) {
  const std::string symbol = "R<sub>d</sub>(x<sub>i</sub>, x<sub>o</sub>)";
  const auto made_by = [&](const char* verb) {
    return header.provenance.find(fmt::format("\"command\":\"{}\"", verb)) !=
           std::string::npos;
  };
  return made_by("simulate")      ? "Simulated truth, " + symbol
         : made_by("reconstruct") ? "Reconstructed " + symbol
         : made_by("import")      ? "Imported " + symbol
                                  : "Dataset " + symbol;
}

}  // namespace

std::string DatasetSection(const std::filesystem::path& path,
                           bool brief,
                           const ProgressFunction& progress) {
  reconstruct::RdReader reader(path);
  const DatasetDigest d = Digest(reader, progress);
  std::string body =
      Facts(d) + Row({AlbedoFigure(d), ProfileFigure(d)}) + SliceFigure(d);
  if (brief) {
    return Section(TitleOf(d.header),
                   path.filename().string(),
                   body + ProvenanceLine(d.header.provenance));
  }
  const std::string checks =
      EnergyTable(d) + ReciprocityCheck(d) +
      Check(d.missing < 0.5,
            d.missing == 0
                ? std::string("Every cell of every window was measured.")
                : fmt::format("{} of all cells were not measured and are marked so.",
                              Percent(d.missing)));
  body += "<h3>Energy and reciprocity</h3>\n" + MapFigures(d, checks) +
          ProvenanceLine(d.header.provenance);
  return Section(TitleOf(d.header), path.filename().string(), body);
}

}  // namespace nacre::cli::report
