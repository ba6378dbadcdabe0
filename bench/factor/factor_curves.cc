// Bytes and time against error, all models:
//
//   factor_curves OUT [quick] NAME=MEASURED.rd.exr,TRUTH.rd.exr
//   NAME=noise:0.001,TRUTH.rd.exr …
//
// "quick" leaves out one term and tail weights of 0.
//
// writes OUT.csv (a line a material), OUT.svg (a row of panels a data set: errors
// against the truth over the size of the file, and over CPU time) and OUT_thesis.svg
// (error and compression against the number of terms). MEASURED is
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

#include "bench/factor/curve_picture.h"

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
  int polynomial = 3;
  int sides = 0;
  bool is_dashed = false;
  int rest = 0;
};

const std::vector<Model>& Models() {
  static const std::vector<Model> models{
      {"svd, floats", "#999999", "svd", {1, 2, 5, 10, 20}, 32, 0, 1, 3, 0, true},
      {"log-svd, floats", "#222222", "log-svd", {2, 5, 10, 20}, 32, 0, 1, 3, 0, true},
      {"svd", "#56b4e9", "svd", {1, 2, 5, 10, 20, 40}},
      {"log-svd", "#0072b2", "log-svd", {2, 5, 10, 20, 30}},
      {"sqrt-svd", "#004d7a", "sqrt-svd", {2, 5, 10, 20, 40}},
      {"log-svd, log weight 1", "#009e73", "log-svd", {2, 5, 10, 20, 30}, 0, 1},
      {"log-svd, log weight 1, floats",
       "#8fd0bf",
       "log-svd",
       {10},
       32,
       1,
       1,
       3,
       0,
       true},
      {"tucker, P = 1", "#c9b458", "tucker", {1, 2, 5, 10, 20}, 0, 0, 1, 1, 0, true},
      {"tucker, P = 2", "#a89030", "tucker", {1, 2, 5, 10, 20}, 0, 0, 1, 2, 0, true},
      {"tucker, P = 3", "#8a7000", "tucker", {1, 2, 5, 10, 20, 40}},
      {"nmf", "#6a3d9a", "nmf", {2, 5, 10, 20, 40}},
      {"profiles", "#b15928", "profiles", {1, 2, 3, 5, 10}},
      {"bilinear, tail weight 0", "#e69f00", "bilinear", {1, 2, 4}, 0, 0, 0},
      {"bilinear", "#d55e00", "bilinear", {1, 2, 4, 6, 9}},
      {"reciprocal, tail weight 0", "#e78ac3", "reciprocal", {1, 2, 4}, 0, 0, 0},
      {"reciprocal", "#aa0066", "reciprocal", {1, 2, 4}},
      {"reciprocal, sides", "#e7298a", "reciprocal", {1, 2, 4, 8}, 0, 0, 1, 3, 1},
      {"reciprocal, rest",
       "#ff0033",
       "reciprocal",
       {1, 2, 4, 8},
       0,
       0,
       1,
       3,
       1,
       false,
       16}};
  return models;
}

struct Point {
  const Model* model;
  int terms;
  double bytes;
  double compression;
  double l2;
  double rmse_over_mean;
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
      if (quick && (model.tail_weight == 0 || terms == 1)) {
        continue;
      }
      factor::FactorOptions options;
      options.method = model.method;
      options.terms = terms;
      options.bits = model.bits;
      options.log_weight = model.log_weight;
      options.tail_weight = model.tail_weight;
      options.polynomial = model.polynomial;
      options.sides = model.sides;
      options.rest = model.rest;
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
      const auto bytes = static_cast<double>(s.bytes);
      points.push_back({&model,
                        terms,
                        bytes,
                        static_cast<double>(s.dataset_bytes) / bytes,
                        e.relative_l2,
                        s.rmse_over_mean,
                        e.log_rms,
                        s.cpu_seconds});
      std::fprintf(stderr, "%s %s %d\n", name.c_str(), model.name, terms);
    }
  }
  return points;
}

using bench::Curve;
using bench::CurvePanel;

// A curve a model over what `x` and `y` take of a point.
template <class X, class Y>
CurvePanel Panel(const std::vector<Point>& points,
                 const std::string& title,
                 const std::string& x_label,
                 const X& x,
                 const Y& y) {
  CurvePanel panel{title, x_label, true, {}};
  for (const Model& model : Models()) {
    Curve curve{model.name, model.color, model.is_dashed, {}};
    for (const Point& p : points) {
      if (p.model == &model) {
        curve.points.emplace_back(x(p), y(p));
      }
    }
    if (!curve.points.empty()) {
      panel.curves.push_back(std::move(curve));
    }
  }
  return panel;
}

using DataPoints = std::vector<std::pair<std::string, std::vector<Point>>>;

// Errors over size and time.
std::string Picture(const DataPoints& all) {
  std::vector<CurvePanel> panels;
  for (const auto& [name, points] : all) {
    const auto bytes = [](const Point& p) { return p.bytes / 1000; };
    const auto l2 = [](const Point& p) { return p.l2; };
    panels.push_back(Panel(points, name + ": relative L2 error", "kB", bytes, l2));
    panels.push_back(
        Panel(points, name + ": log error", "kB", bytes, [](const Point& p) {
          return p.log_rms;
        }));
    panels.push_back(Panel(
        points,
        name + ": relative L2 error",
        "CPU seconds",
        [](const Point& p) { return std::max(p.cpu_seconds, 0.01); },
        l2));
  }
  return CurvePicture(panels, 3);
}

// The thesis' figures: error and compression of the SVDs against S (4.8), and of the
// Tucker model against T and P (4.6).
std::string ThesisPicture(const DataPoints& all) {
  std::vector<CurvePanel> panels;
  for (const auto& [name, points] : all) {
    std::vector<Point> svds;
    std::vector<Point> tucker;
    for (const Point& p : points) {
      if (p.model->bits == 32) {
        svds.push_back(p);
      } else if (p.model->method == std::string("tucker")) {
        tucker.push_back(p);
      }
    }
    const auto terms = [](const Point& p) { return static_cast<double>(p.terms); };
    const auto rmse = [](const Point& p) { return p.rmse_over_mean; };
    const auto ratio = [](const Point& p) { return p.compression; };
    panels.push_back(Panel(svds, name + ": RMSE over mean", "terms S", terms, rmse));
    panels.push_back(Panel(svds, name + ": compression", "terms S", terms, ratio));
    panels.push_back(Panel(tucker, name + ": RMSE over mean", "terms T", terms, rmse));
    panels.push_back(Panel(tucker, name + ": compression", "terms T", terms, ratio));
  }
  for (CurvePanel& panel : panels) {
    panel.log_x = false;
  }
  return CurvePicture(panels, 4);
}

int Main(int argc, char** argv) {
  if (argc < 3) {
    throw UsageError("factor_curves OUT NAME=MEASURED.rd.exr,TRUTH.rd.exr …");
  }
  std::string csv =
      "dataset,model,terms,bits,bytes,relative_l2,log_rms,true_relative_l2,"
      "true_log_rms,worst_total,cpu_seconds\n";
  DataPoints all;
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
  WriteFile(std::string(argv[1]) + "_thesis.svg", ThesisPicture(all));
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
