#include "cli/report/html.h"
#include "cli/report/line_plot.h"
#include "cli/report/raster.h"
#include "cli/report/sections.h"
#include "factor/material.h"

#include <algorithm>
#include <fmt/format.h>
#include <functional>

namespace nacre::cli::report {
namespace {

using factor::Material;

std::string ErrorOf(const Material& m, const char* key, bool percent) {
  const auto found = m.error.find(key);
  if (found == m.error.end()) {
    return "–";
  }
  return percent ? Percent(found->second) : Number(found->second);
}

std::string Facts(const Material& m) {
  const auto stored = static_cast<double>(factor::FileBytes(m));
  const double measured = 4.0 * static_cast<double>(m.PointCount() * m.WindowSize()) *
                          static_cast<double>(m.channels.size());
  std::vector<Fact> facts{
      {"Method", Escape(m.method)},
      {m.MapSets() == 1 ? "Terms" : "Terms a channel", std::to_string(m.terms)},
      {"Size of the file", Bytes(stored)},
      {"Compression", fmt::format("{} : 1", Number(measured / stored))},
      {"Error, relative L<sup>2</sup>", ErrorOf(m, "relative_l2", true)},
      {"RMSE over mean", ErrorOf(m, "rmse_over_mean", true)},
      {"Log error, rms", ErrorOf(m, "log_rms", false)},
      {"PSNR", ErrorOf(m, "psnr_db", false) + " dB"},
      {"Worst slice", ErrorOf(m, "worst_slice", true)}};
  if (m.cluster_count > 1) {
    facts.push_back({"Clusters", std::to_string(m.cluster_count)});
  }
  return FactList(facts);
}

std::string AlbedoFigure(const Material& m) {
  std::vector<Plane> planes;
  float largest = 0;
  const auto points = static_cast<std::size_t>(m.PointCount());
  for (const std::size_t c : PictureChannels(m.channels)) {
    planes.push_back({m.points_x, m.points_y, {&m.albedo[c * points], points}});
    largest = std::max(
        largest,
        *std::max_element(planes.back().values.begin(), planes.back().values.end()));
  }
  return Figure(
      ImageTag(ColorImage(planes, largest > 0 ? 1 / static_cast<double>(largest) : 1),
               "albedo of the material",
               "pixels"),
      fmt::format("The material by its albedo, white being {}.",
                  Number(static_cast<double>(largest))),
      "narrow");
}

std::string CurveFigures(const Material& m) {
  if (m.error_curve.size() < 2) {
    return "";
  }
  Series l2{.name = "", .color = 5, .x = {}, .y = {}, .low = {}, .high = {}};
  Series log{.name = "", .color = 3, .x = {}, .y = {}, .low = {}, .high = {}};
  for (const factor::TermsError& point : m.error_curve) {
    l2.x.push_back(point.terms);
    l2.y.push_back(100 * point.relative_l2);
    log.x.push_back(point.terms);
    log.y.push_back(point.log_rms);
  }
  return Row(
      {Figure(LinePlot({l2},
                       {.x_label = "terms",
                        .y_label = "relative L² error (%)",
                        .log_y = true,
                        .markers = true,
                        .width = 460,
                        .height = 260}),
              "Error in R<sub>d</sub> against terms, on a sample of the slices."),
       Figure(LinePlot({log},
                       {.x_label = "terms",
                        .y_label = "rms of ln(model / measured)",
                        .markers = true,
                        .y_from_zero = true,
                        .width = 460,
                        .height = 260}),
              "Error in ln R<sub>d</sub>, above 10<sup>−5</sup> of the peak: how well "
              "the tails are kept.")});
}

constexpr int kMostColumns = 12;

// A row a channel, a column a map or kernel; every picture has a colour scale of its
// own.
template <class PlaneOf>
std::string Sheet(const std::vector<std::string>& rows,
                  int count,
                  const std::function<std::string(int)>& label_of,
                  PlaneOf&& plane_of) {
  const int columns = std::min(count, kMostColumns);
  std::string grid = fmt::format(
      "<div class=\"grid\" style=\"grid-template-columns:auto "
      "repeat({},minmax(0,1fr))\">\n<span></span>",
      columns);
  for (int term = 0; term < columns; ++term) {
    grid += "<span>" + label_of(term) + "</span>";
  }
  for (std::size_t c = 0; c < rows.size(); ++c) {
    grid += "\n<span class=\"side\">" + Escape(rows[c]) + "</span>";
    for (int term = 0; term < columns; ++term) {
      grid += ImageTag(DivergingImage(plane_of(static_cast<int>(c), term)),
                       fmt::format("picture {} of {}", term + 1, rows[c]),
                       "pixels");
    }
  }
  return grid + "</div>\n" +
         ColorScale("− largest magnitude", "+ largest magnitude", true);
}

// "1", or "1,2" for the kernel that joins two maps; of a reciprocal material "0" for
// the constant, then "1" for the ends' taps, "1′", "1″" for those in between, then
// pairs.
std::string KernelName(const Material& m, int n) {
  if (m.form != factor::Form::kBilinear && m.form != factor::Form::kReciprocal) {
    return std::to_string(n + 1);
  }
  if (m.form == factor::Form::kReciprocal) {
    if (n == 0) {
      return "0";
    }
    const int tap = (n - 1) / m.terms;
    if (tap < m.taps) {
      std::string name = std::to_string((n - 1) % m.terms + 1);
      for (int mark = 0; mark < tap; ++mark) {
        name += "′";
      }
      return name;
    }
    n -= 1 + m.taps * m.terms;
    const int beyond = n - m.terms * (m.terms + 1) / 2;
    if (beyond >= 0) {
      return beyond < m.rest ? fmt::format("v{}", beyond + 1) : "g";
    }
  }
  int first = 0;
  while (n >= m.terms - first) {
    n -= m.terms - first++;
  }
  return fmt::format("{},{}", first + 1, first + 1 + n);
}

std::string FirstOf(int count) {
  return count > kMostColumns ? fmt::format(" The first {} of {}.", kMostColumns, count)
                              : "";
}

std::string SheetFigures(const Material& m) {
  const auto kernel_size = static_cast<std::size_t>(m.KernelSize());
  const auto map_size = static_cast<std::size_t>(m.MapSize());
  const bool is_sum = m.form == factor::Form::kSum || m.form == factor::Form::kTucker;
  const std::string kernels = Sheet(
      m.KernelSets() == 1 ? std::vector<std::string>{"all"} : m.channels,
      m.KernelCount(),
      [&](int n) { return "<i>h</i><sub>" + KernelName(m, n) + "</sub>"; },
      [&](int c, int n) {
        return Plane{m.KernelWidth(),
                     static_cast<int>(m.KernelSize() / m.KernelWidth()),
                     {m.Kernel(c, 0, n), kernel_size}};
      });
  const std::string maps = Sheet(
      m.SharesMaps() ? std::vector<std::string>{"all"} : m.channels,
      m.terms,
      [](int n) { return fmt::format("<i>f</i><sub>{}</sub>", n + 1); },
      [&](int c, int n) {
        return Plane{m.MapWidth(), m.MapHeight(), {m.FactorMap(c, n), map_size}};
      });
  const std::string clusters =
      m.cluster_count > 1
          ? fmt::format(" Of the first of {} clusters.", m.cluster_count)
          : "";
  const int radius = (m.core - 1) / 2;
  const std::string beyond =
      m.margin > 0 ? fmt::format(" They go on for {} points beyond the grid.", m.margin)
                   : "";
  return Figure(kernels,
                fmt::format("Kernels h(d), ±{} mm: {}.{}{}",
                            Number(radius * m.pitch_mm),
                            is_sum ? "the shapes that every slice is a sum of"
                                   : "how light goes from one map to another",
                            FirstOf(m.KernelCount()),
                            clusters)) +
         Figure(maps,
                fmt::format("Factor maps f<sub>j</sub>: {}; mean square 1 over the "
                            "sample.{}{}",
                            m.SharesMaps() ? "one set for all channels"
                                           : "how much of each kernel is at each point",
                            FirstOf(m.terms),
                            beyond));
}

std::string TransformTable(const Material& m) {
  if (m.form == factor::Form::kBilinear) {
    return "<p>R<sub>d</sub> = Σ<sub>jk</sub> f<sub>j</sub>(x<sub>i</sub>) "
           "h<sub>jk</sub>(d) f<sub>k</sub>(x<sub>o</sub>), h<sub>jk</sub>(d) = "
           "h<sub>kj</sub>(−d): the same from x<sub>i</sub> to x<sub>o</sub> and back, "
           "to the last bit.</p>";
  }
  if (m.form == factor::Form::kReciprocal) {
    return "<p>R<sub>d</sub> = A exp(h<sub>0</sub>(d) + Σ<sub>jt</sub> "
           "h<sub>jt</sub>(d) "
           "φ<sub>t</sub>[f<sub>j</sub>] + Σ<sub>jk</sub> h<sub>jk</sub>(d) "
           "f<sub>j</sub>(x<sub>i</sub>) f<sub>k</sub>(x<sub>o</sub>)), h(d) = h(−d), "
           "φ "
           "being the maps' values at both ends and at places in between: positive, "
           "and "
           "the same from x<sub>i</sub> to x<sub>o</sub> and back, to the last "
           "bit.</p>";
  }
  if (m.form == factor::Form::kTucker) {
    return "<p>R<sub>d</sub> = Σ<sub>p</sub> a<sub>p</sub>(x<sub>i</sub>) "
           "(Σ<sub>t</sub> f<sub>t</sub>(x<sub>i</sub>) h<sub>t</sub>(d − shift))"
           "<sup>p</sup>: slices shifted so that their maximum comes first, a "
           "polynomial of their mean over the channels for each channel.</p>";
  }
  if (m.form == factor::Form::kProfiles) {
    return "<p>R<sub>d</sub> = √(P(x<sub>i</sub>) P(x<sub>o</sub>)), P a sum of "
           "Gaussians of the distance, one map of weights each; kernels are ln β, β in "
           "mm<sup>−2</sup>: the same from x<sub>i</sub> to x<sub>o</sub> and "
           "back.</p>";
  }
  if (m.transform != factor::Transform::kLog) {
    return "<p>R<sub>d</sub> = Σ<sub>j</sub> f<sub>j</sub> h<sub>j</sub>, a channel at "
           "a "
           "time, each slice scaled to its measured total.</p>";
  }
  std::vector<std::vector<std::string>> rows;
  for (std::size_t c = 0; c < m.channels.size(); ++c) {
    rows.push_back({Escape(m.channels[c]), Number(m.a[c], 4), Number(m.b[c], 4)});
  }
  return "<p>R<sub>d</sub> = A (exp(Σ<sub>j</sub> f<sub>j</sub> h<sub>j</sub>) − B), a "
         "channel at a time, each slice scaled to its measured total. A and B were "
         "chosen "
         "for the least error in R<sub>d</sub>.</p>" +
         Table({"Channel", "A (mm<sup>−2</sup>)", "B"}, rows);
}

}  // namespace

std::string MaterialSection(const std::filesystem::path& path) {
  const Material m = factor::ReadMaterial(path);
  return Section("Material",
                 path.filename().string(),
                 Facts(m) +
                     Row({AlbedoFigure(m),
                          "<div class=\"grow\">" + TransformTable(m) + "</div>"}) +
                     CurveFigures(m) + SheetFigures(m) + ProvenanceLine(m.provenance));
}

}  // namespace nacre::cli::report
