#include "cli/artefact.h"
#include "cli/report/raster.h"
#include "cli/view/sample.h"
#include "cli/view/view.h"
#include "core/error.h"
#include "core/json.h"

#include <cmath>
#include <fmt/format.h>

namespace nacre::cli::view {
namespace {

using reconstruct::RdHeader;
using reconstruct::RdSlice;
using web::Answer;
using web::Query;

// What the handlers share.
struct Shown {
  std::unique_ptr<Sample> sample;
  std::unique_ptr<Sample> other;  // may be null
  std::string title;
};

using Shared = std::shared_ptr<const Shown>;

// The three channels of a colour picture, or the first alone.
std::vector<report::Plane> Planes(const RdHeader& header,
                                  const std::vector<std::vector<float>>& values) {
  std::vector<report::Plane> planes;
  for (std::size_t c = 0; c < (values.size() >= 3 ? 3U : 1U); ++c) {
    planes.push_back({header.points_x, header.points_y, values[c]});
  }
  return planes;
}

Answer Png(const PngImage& image) {
  return {EncodePng(image, 1), "image/png"};
}

Json StateOf(const Shown& shown) {
  const RdHeader& h = shown.sample->header();
  const factor::Material* m = shown.sample->material();
  Json state{{"kind", m != nullptr ? "material" : "dataset"},
             {"title", shown.title},
             {"points", {h.points_x, h.points_y}},
             {"core", h.core},
             {"pitch_mm", h.pitch_mm},
             {"eta", h.eta},
             {"channels", h.channels},
             {"largest_albedo", shown.sample->LargestAlbedo()},
             {"against", shown.other != nullptr}};
  if (m == nullptr) {
    return state;
  }
  state["method"] = m->method;
  state["terms"] = m->terms;
  state["maps"] = m->MapCount();
  state["map_sets"] = m->MapSets();
  state["kernels"] = m->KernelCount();
  state["kernel_sets"] = m->KernelSets();
  state["clusters"] = m->cluster_count;
  state["error"] = m->error;
  // Fewer terms are a lesser model only where terms are added up.
  state["sums_terms"] = m->form == factor::Form::kSum;
  state["error_curve"] = Json::array();
  for (const factor::TermsError& point : m->error_curve) {
    state["error_curve"].push_back({{"terms", point.terms},
                                    {"relative_l2", point.relative_l2},
                                    {"log_rms", point.log_rms}});
  }
  return state;
}

Json ChannelJson(const RdHeader& header, const RdSlice& slice, std::size_t c) {
  const auto size = static_cast<std::size_t>(header.WindowSize());
  const auto begin = slice.rd.begin() + static_cast<std::ptrdiff_t>(c * size);
  const std::vector<float> rd(begin, begin + static_cast<std::ptrdiff_t>(size));
  double total = 0;
  for (const float value : rd) {
    total += static_cast<double>(value);
  }
  return {{"name", header.channels[c]},
          {"rd", rd},
          {"albedo", total * header.CellAreaMm2()}};
}

Answer SliceOf(const Shown& shown, const Query& query) {
  const RdHeader& h = shown.sample->header();
  const int i = web::Number(query, "i", 0, h.points_x - 1, 0);
  const int j = web::Number(query, "j", 0, h.points_y - 1, 0);
  const int terms = web::Number(query, "terms", 0, 1 << 20, 0);
  const RdSlice slice = shown.sample->Slice(i, j, terms);
  const PointMm at = h.GridPoint(i, j);
  Json json{{"i", i},
            {"j", j},
            {"x_mm", at.x},
            {"y_mm", at.y},
            {"valid", std::vector<int>(slice.valid.begin(), slice.valid.end())},
            {"channels", Json::array()}};
  std::optional<RdSlice> other;
  if (shown.other) {
    other = shown.other->Slice(i, j, 0);
  }
  for (std::size_t c = 0; c < h.channels.size(); ++c) {
    json["channels"].push_back(ChannelJson(h, slice, c));
    if (other) {
      json["channels"].back()["other"] = ChannelJson(h, *other, c)["rd"];
    }
  }
  return {json.dump()};
}

Answer LightOf(const Shown& shown, const Query& query) {
  const RdHeader& h = shown.sample->header();
  const double half_x = 0.5 * h.points_x * h.pitch_mm;
  const double half_y = 0.5 * h.points_y * h.pitch_mm;
  const double x = web::Real(query, "x", -half_x, half_x, 0);
  const double y = web::Real(query, "y", -half_y, half_y, 0);
  const double radius =
      web::Real(query, "r", 0, std::hypot(half_x, half_y), h.pitch_mm);
  const double stops = web::Real(query, "ev", -20, 20, 0);
  const auto exitance = LightDisc(*shown.sample, x, y, radius);
  return Png(report::ColorImage(
      Planes(h, exitance),
      std::exp2(stops) /
          std::max(1e-9, static_cast<double>(shown.sample->LargestAlbedo()))));
}

Answer MapOf(const factor::Material& m, const Query& query) {
  const int set = web::Number(query, "channel", 0, m.MapSets() - 1, 0);
  const int n = web::Number(query, "n", 0, m.MapCount() - 1, 0);
  return Png(report::DivergingImage(
      {m.MapWidth(),
       m.MapHeight(),
       {m.FactorMap(set, n), static_cast<std::size_t>(m.MapSize())}}));
}

Answer KernelOf(const factor::Material& m, const Query& query) {
  const int set = web::Number(query, "channel", 0, m.KernelSets() - 1, 0);
  const int cluster = web::Number(query, "cluster", 0, m.cluster_count - 1, 0);
  const int n = web::Number(query, "n", 0, m.KernelCount() - 1, 0);
  const int width = m.KernelWidth();
  return Png(report::DivergingImage(
      {width,
       static_cast<int>(m.KernelSize() / width),
       {m.Kernel(set, cluster, n), static_cast<std::size_t>(m.KernelSize())}}));
}

void CheckSameGrid(const RdHeader& a, const RdHeader& b, const std::string& origin) {
  if (a.points_x != b.points_x || a.points_y != b.points_y || a.core != b.core ||
      a.channels != b.channels) {
    throw BadData(
        fmt::format("{}: {} x {} points, core {}, {} channels; what it is compared "
                    "with has {} x {}, "
                    "core {}, {}",
                    origin,
                    b.points_x,
                    b.points_y,
                    b.core,
                    b.channels.size(),
                    a.points_x,
                    a.points_y,
                    a.core,
                    a.channels.size()));
  }
}

}  // namespace

std::map<std::string, web::Handler> SampleView(const std::filesystem::path& path,
                                               const std::filesystem::path& against,
                                               const ProgressFunction& progress) {
  auto shown = std::make_shared<Shown>();
  shown->sample = OpenSample(path, progress);
  shown->title = path.filename().string();
  if (!against.empty()) {
    shown->other = OpenSample(against, progress);
    CheckSameGrid(shown->sample->header(), shown->other->header(), against.string());
  }
  const Shared s = shown;
  std::map<std::string, web::Handler> routes{
      {"state.json", [s](const Query&) { return Answer{StateOf(*s).dump()}; }},
      {"slice.json", [s](const Query& query) { return SliceOf(*s, query); }},
      {"light.png", [s](const Query& query) { return LightOf(*s, query); }},
      {"albedo.png", [s](const Query&) {
         return Png(report::ColorImage(
             Planes(s->sample->header(), s->sample->albedo()),
             1 / std::max(1e-9, static_cast<double>(s->sample->LargestAlbedo()))));
       }}};
  if (s->sample->material() != nullptr) {
    routes["map.png"] = [s](const Query& query) {
      return MapOf(*s->sample->material(), query);
    };
    routes["kernel.png"] = [s](const Query& query) {
      return KernelOf(*s->sample->material(), query);
    };
  }
  return routes;
}

}  // namespace nacre::cli::view
