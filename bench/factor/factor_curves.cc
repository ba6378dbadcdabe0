// Bytes and time against error, all models:
//
//   factor_curves OUT [quick] NAME=MEASURED.rd.exr,TRUTH.rd.exr
//   NAME=noise:0.001,TRUTH.rd.exr …
//
// "quick" takes the plain models with 2, 4 and 10 terms alone.
//
// writes OUT.csv (a line a material) and OUT.svg (a row of panels a data set: errors
// against the truth over the size of the file, and over CPU time). MEASURED is
// factored; the errors are against TRUTH. "noise:N" measures the truth with photon
// noise of N peaks at a channel's peak, and readout noise of 1e-5 peaks, which sigma
// tells.

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/random.h"
#include "factor/factor.h"
#include "reconstruct/error_figures.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fmt/format.h>
#include <iterator>
#include <numbers>

namespace nacre {
namespace {

struct Model {
  const char* name;
  const char* color;
  const char* method;
  std::vector<int> terms;
  double bits = 0;
  double log_weight = 0;
  double tail_weight = 1;
};

const std::vector<Model>& Models() {
  static const std::vector<Model> models{
      {"svd, floats", "#999999", "svd", {1, 2, 5, 10, 20}, 32},
      {"log-svd, floats", "#222222", "log-svd", {2, 5, 10, 20}, 32},
      {"svd", "#56b4e9", "svd", {1, 2, 5, 10, 20}},
      {"log-svd", "#0072b2", "log-svd", {2, 5, 10, 20}},
      {"log-svd, log weight 1", "#009e73", "log-svd", {2, 5, 10, 20}, 0, 1},
      {"bilinear, tail weight 0", "#e69f00", "bilinear", {1, 2, 4, 8}, 0, 0, 0},
      {"bilinear", "#d55e00", "bilinear", {1, 2, 4, 8}},
      {"reciprocal, tail weight 0", "#cc79a7", "reciprocal", {1, 2, 4, 8, 12}, 0, 0, 0},
      {"reciprocal", "#aa0066", "reciprocal", {1, 2, 4, 8, 12}}};
  return models;
}

struct Point {
  const Model* model;
  double bytes;
  double l2;
  double log_rms;
  double cpu_seconds;
};

reconstruct::SliceSource SourceOf(const factor::Material& m,
                                  const reconstruct::RdHeader& header) {
  return {
      header, [&m, header](int i, int j) {
        reconstruct::RdSlice slice = reconstruct::MakeSlice(header);
        for (int c = 0; c < static_cast<int>(header.channels.size()); ++c) {
          m.EvaluateWindow(
              c, i, j, &slice.rd[static_cast<std::size_t>(c * header.WindowSize())]);
        }
        return slice;
      }};
}

// A measurement of the truth.
void AddNoise(double at_peak, std::uint64_t seed, reconstruct::RdDataset& dataset) {
  constexpr double kReadout = 1e-5;
  const auto window = static_cast<std::size_t>(dataset.header.WindowSize());
  const std::size_t channels = dataset.header.channels.size();
  std::vector<double> peaks(channels, 0.0);
  for (std::size_t n = 0; n < dataset.rd.size(); ++n) {
    double& peak = peaks[n / window % channels];
    peak = std::max(peak, static_cast<double>(dataset.rd[n]));
  }
  RandomStream random(seed, 0);
  dataset.sigma.resize(dataset.rd.size());
  for (std::size_t n = 0; n < dataset.rd.size(); ++n) {
    const double peak = peaks[n / window % channels];
    const double value = static_cast<double>(dataset.rd[n]) / peak;
    const double sigma = std::sqrt(at_peak * at_peak * value + kReadout * kReadout);
    const double radius = std::sqrt(-2 * std::log(1 - random.Uniform()));
    const double normal = radius * std::cos(2 * std::numbers::pi * random.Uniform());
    dataset.rd[n] = static_cast<float>(peak * (value + sigma * normal));
    dataset.sigma[n] = static_cast<float>(peak * sigma);
  }
}

reconstruct::RdDataset Measure(const std::string& measured, const std::string& truth) {
  constexpr const char* kNoise = "noise:";
  if (!measured.starts_with(kNoise)) {
    return reconstruct::ReadDataset(measured);
  }
  reconstruct::RdDataset dataset = reconstruct::ReadDataset(truth);
  AddNoise(std::stod(measured.substr(std::string(kNoise).size())), 1, dataset);
  return dataset;
}

std::vector<Point> Run(const std::string& name,
                       const std::string& measured,
                       const std::string& truth,
                       bool quick,
                       std::string& csv) {
  const reconstruct::RdDataset dataset = Measure(measured, truth);
  const reconstruct::SliceSource reference = reconstruct::DatasetSource(truth);
  std::vector<Point> points;
  for (const Model& model : Models()) {
    for (const int terms : model.terms) {
      const bool is_main = model.log_weight == 0 && model.tail_weight == 1;
      if (quick && !(is_main && (terms == 2 || terms == 4 || terms == 10))) {
        continue;
      }
      factor::FactorOptions options;
      options.method = model.method;
      options.terms = terms;
      options.bits = model.bits;
      options.log_weight = model.log_weight;
      options.tail_weight = model.tail_weight;
      const auto [m, s] = factor::Factor(dataset, options);
      if (s.terms < terms) {
        continue;  // the same as fewer terms
      }
      const reconstruct::ErrorFigures e =
          reconstruct::CompareSlices(reference, SourceOf(m, dataset.header));
      csv +=
          fmt::format("{},\"{}\",{},{},{},{:.6g},{:.6g},{:.6g},{:.6g},{:.3g},{:.3g}\n",
                      name,
                      model.name,
                      s.terms,
                      s.bits,
                      s.bytes,
                      s.relative_l2,
                      s.log_rms,
                      e.relative_l2,
                      e.log_rms,
                      s.worst_total,
                      s.cpu_seconds);
      points.push_back({&model,
                        static_cast<double>(s.bytes),
                        e.relative_l2,
                        e.log_rms,
                        s.cpu_seconds});
      std::fprintf(stderr, "%s %s %d\n", name.c_str(), model.name, terms);
    }
  }
  return points;
}

constexpr double kPanelWidth = 420;
constexpr double kPanelHeight = 300;

// One log-log panel with its upper left corner at (x, y): an error over bytes or time.
std::string Panel(const std::vector<Point>& points,
                  double Point::*over,
                  double Point::*error,
                  const std::string& title,
                  double x,
                  double y) {
  double low = 1e300;
  double high = 0;
  double least = 1e300;
  double most = 0;
  for (const Point& p : points) {
    low = std::min(low, p.*error);
    high = std::max(high, p.*error);
    least = std::min(least, p.*over);
    most = std::max(most, p.*over);
  }
  const auto place = [](double value, double from, double to, double size) {
    return size * std::log(value / from) / std::log(std::max(to / from, 1.001));
  };
  const auto label = [&](double value) {
    return over == &Point::bytes ? fmt::format("{:.0f} kB", value / 1e3)
                                 : fmt::format("{:.2g} CPU-s", value);
  };
  const double width = kPanelWidth - 90;
  const double height = kPanelHeight - 70;
  std::string svg = fmt::format(
      "<g transform=\"translate({} {})\"><text y=\"-8\" font-weight=\"bold\">{}</text>"
      "<rect width=\"{}\" height=\"{}\" fill=\"none\" stroke=\"#bbb\"/>"
      "<text y=\"{}\">{}</text><text x=\"{}\" y=\"{}\" "
      "text-anchor=\"end\">{}</text><text x=\"-4\" y=\"{}\" "
      "text-anchor=\"end\">{:.2g}</text><text x=\"-4\" y=\"8\" "
      "text-anchor=\"end\">{:.2g}</text>\n",
      x + 50,
      y + 30,
      title,
      width,
      height,
      height + 14,
      label(least),
      width,
      height + 14,
      label(most),
      height,
      low,
      high);
  for (const Model& model : Models()) {
    std::string line;
    for (const Point& p : points) {
      if (p.model == &model) {
        const double px = place(p.*over, least, most, width);
        const double py = height - place(p.*error, low, high, height);
        line += fmt::format("{:.1f},{:.1f} ", px, py);
        svg += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3\" fill=\"{}\"/>",
                           px,
                           py,
                           model.color);
      }
    }
    svg += fmt::format(
        "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\"/>\n", line, model.color);
  }
  return svg + "</g>\n";
}

std::string Picture(
    const std::vector<std::pair<std::string, std::vector<Point>>>& all) {
  const double height = kPanelHeight * static_cast<double>(all.size()) + 40;
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" "
      "viewBox=\"0 0 {0} {1}\" font-family=\"sans-serif\" font-size=\"11\">\n"
      "<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n",
      3 * kPanelWidth,
      height);
  double y = 0;
  for (const auto& [name, points] : all) {
    const std::string l2 = name + ": relative L2 error";
    svg += Panel(points, &Point::bytes, &Point::l2, l2, 0, y);
    svg += Panel(
        points, &Point::bytes, &Point::log_rms, name + ": log error", kPanelWidth, y);
    svg += Panel(points, &Point::cpu_seconds, &Point::l2, l2, 2 * kPanelWidth, y);
    y += kPanelHeight;
  }
  double x = 20;
  for (const Model& model : Models()) {
    svg += fmt::format("<text x=\"{}\" y=\"{}\" fill=\"{}\">{}</text>",
                       x,
                       y + 16,
                       model.color,
                       model.name);
    x += 118;
  }
  return svg + "</svg>\n";
}

int Main(int argc, char** argv) {
  if (argc < 3) {
    throw UsageError("factor_curves OUT NAME=MEASURED.rd.exr,TRUTH.rd.exr …");
  }
  std::string csv =
      "dataset,model,terms,bits,bytes,relative_l2,log_rms,true_relative_l2,"
      "true_log_rms,worst_total,cpu_seconds\n";
  std::vector<std::pair<std::string, std::vector<Point>>> all;
  bool quick = false;
  for (int n = 2; n < argc; ++n) {
    const std::string text = argv[n];
    if (text == "quick") {
      quick = true;
      continue;
    }
    const auto equals = text.find('=');
    const auto comma = text.find(',');
    if (equals == std::string::npos || comma == std::string::npos || comma < equals) {
      throw UsageError(text + " isn't NAME=MEASURED,TRUTH");
    }
    const std::string name = text.substr(0, equals);
    all.emplace_back(name,
                     Run(name,
                         text.substr(equals + 1, comma - equals - 1),
                         text.substr(comma + 1),
                         quick,
                         csv));
  }
  WriteFile(std::string(argv[1]) + ".csv", csv);
  WriteFile(std::string(argv[1]) + ".svg", Picture(all));
  return 0;
}

}  // namespace
}  // namespace nacre

int main(int argc, char** argv) {
  try {
    return nacre::Main(argc, argv);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 1;
  }
}
