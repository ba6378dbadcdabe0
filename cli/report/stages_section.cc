#include "cli/report/html.h"
#include "cli/report/sections.h"
#include "core/json.h"

#include <algorithm>
#include <fmt/format.h>

namespace nacre::cli::report {
namespace {

struct Stage {
  std::string name;
  double seconds = 0;
  double cpu_seconds = 0;
  double peak_mb = 0;
  std::string error;
  std::string output;
};

std::vector<Stage> ParseStages(const Json& json, const std::string& origin) {
  std::vector<Stage> stages;
  const Json list = Get<Json>(json, "stages", origin);
  for (const Json& entry : list) {
    Stage stage{Get<std::string>(entry, "name", origin),
                Get<double>(entry, "seconds", origin),
                Get<double>(entry, "cpu_seconds", origin),
                Get<double>(entry, "peak_mb", origin),
                Get<std::string>(entry, "error", origin),
                Get<std::string>(entry, "output", origin)};
    stages.push_back(std::move(stage));
  }
  return stages;
}

std::string Bar(double fraction) {
  return fmt::format("<span class=\"track\"><i style=\"width:{:.1f}%\"></i></span>",
                     100 * fraction);
}

}  // namespace

std::string StagesSection(const Json& json, const std::string& origin) {
  const std::vector<Stage> stages = ParseStages(json, origin);
  double longest = 0;
  Stage total;
  for (const Stage& stage : stages) {
    longest = std::max(longest, stage.seconds);
    total.seconds += stage.seconds;
    total.cpu_seconds += stage.cpu_seconds;
    total.peak_mb = std::max(total.peak_mb, stage.peak_mb);
  }
  std::vector<std::vector<std::string>> rows;
  const auto row = [&](const Stage& stage, const std::string& bar) {
    rows.push_back({Escape(stage.name),
                    "<code>" + Escape(stage.output) + "</code>",
                    Prose(stage.error),
                    bar,
                    fmt::format("{:.1f}", stage.seconds),
                    fmt::format("{:.1f}", stage.cpu_seconds),
                    stage.peak_mb > 0 ? fmt::format("{:.0f}", stage.peak_mb) : "–"});
  };
  for (const Stage& stage : stages) {
    row(stage, Bar(longest > 0 ? stage.seconds / longest : 0));
  }
  total.name = "all stages";
  row(total, "");
  for (std::string& cell : rows.back()) {
    cell = cell.empty() ? cell : fmt::format("<b>{}</b>", cell);
  }
  return Section(
      "Where the time went",
      "",
      Table({"Stage", "output", "error", "", "time (s)", "CPU (s)", "peak memory (MB)"},
            rows,
            4));
}

}  // namespace nacre::cli::report
