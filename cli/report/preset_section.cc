#include "cli/preset/preset.h"
#include "cli/report/html.h"
#include "cli/report/raster.h"
#include "cli/report/sections.h"
#include "core/atomic_file.h"
#include "core/exr.h"

#include <algorithm>
#include <fmt/format.h>

namespace nacre::cli::report {
namespace {

std::string ErrorOf(const preset::Preset& p, const char* key, bool percent) {
  const auto found = p.error.find(key);
  if (found == p.error.end()) {
    return "–";
  }
  return percent ? Percent(found->second) : Number(found->second);
}

std::string Facts(const preset::Preset& p) {
  return FactList(
      {{"Name in scenes", "<code>" + Escape(p.name) + "</code>"},
       {"Author", Escape(p.author)},
       {"Licence", Escape(p.licence)},
       {"Sample", fmt::format("{:.4g} × {:.4g} mm", p.width_mm, p.height_mm)},
       {"Refractive index", Number(p.eta)},
       {"Method", Escape(p.method)},
       {"Terms", std::to_string(p.terms)},
       {"Error, relative L<sup>2</sup>", ErrorOf(p, "relative_l2", true)},
       {"Log error, rms", ErrorOf(p, "log_rms", false)},
       {"Worst slice", ErrorOf(p, "worst_slice", true)},
       {"Size, all files", Bytes(static_cast<double>(p.Bytes()))}});
}

// A map of the fit that other renderers get; its first three channels as a colour.
std::string MapFigure(const preset::Preset& p,
                      const char* role,
                      const std::string& what,
                      const std::string& unit) {
  const ExrPart map = ReadExr(p.File(role)).front();
  std::vector<Plane> planes;
  float largest = 0;
  for (const std::size_t c : PictureChannels(map.channels)) {
    planes.push_back({map.width, map.height, {map.Channel(c), map.PixelCount()}});
    const auto& values = planes.back().values;
    largest = std::max(largest, *std::max_element(values.begin(), values.end()));
  }
  const auto white = static_cast<double>(largest);
  return Figure(ImageTag(ColorImage(planes, white > 0 ? 1 / white : 1), what, "pixels"),
                fmt::format("{}; white is {}{}.", what, Number(white), unit),
                "narrow");
}

std::string Checks(const preset::Preset& p) {
  const std::vector<std::string> problems = preset::CheckPreset(p);
  std::string checks;
  for (const std::string& problem : problems) {
    checks += Check(false, Escape(problem));
  }
  return problems.empty()
             ? Check(true,
                     "Whole: every file is as it was written, and obeys the laws.")
             : checks;
}

}  // namespace

std::string PresetSection(const std::filesystem::path& folder) {
  const preset::Preset p = preset::ReadPreset(folder);
  const std::string source =
      p.dataset_file.empty()
          ? ""
          : fmt::format("<p>Factored from <code>{}</code>, XXH3 <code>{}</code>.</p>",
                        Escape(p.dataset_file),
                        Escape(p.dataset_hash));
  const std::string notes = p.notes.empty() ? "" : "<p>" + Prose(p.notes) + "</p>";
  const std::string thumbnail =
      Figure(ImageTag(ReadFile(p.File("thumbnail")), "thumbnail of " + p.title),
             "As the list shows it.",
             "narrow");
  return Section(Escape(p.title),
                 p.name,
                 Facts(p) + Checks(p) + notes + source +
                     Row({thumbnail,
                          MapFigure(p, "albedo", "Albedo, fitted", ""),
                          MapFigure(p, "radius", "Length d of Burley’s profile", " mm"),
                          MapFigure(p, "residual", "What that fit misses of A", "")})) +
         MaterialSection(p.File("material"));
}

}  // namespace nacre::cli::report
