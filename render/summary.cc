#include "core/json.h"
#include "render/render.h"

#include <fmt/format.h>

namespace nacre::render {

std::string RenderSummary::Brief() const {
  std::string line = fmt::format(
      "{} x {} pixels, {} samples each, {:.1f} s on {} threads ({:.1f} CPU-s)",
      width,
      height,
      samples_per_pixel,
      build_s + seen_s + irradiance_s + models_s + paths_s,
      thread_count_used,
      cpu_s);
  if (samples_least < samples_most) {
    line += fmt::format(" ({} to {})", samples_least, samples_most);
  }
  if (samples_resumed > 0) {
    line += fmt::format("; {} samples each were there already", samples_resumed);
  }
  if (time_ran_out) {
    line += "; stopped by the time limit";
  }
  if (lit_points_capped) {
    line += "; fewer lit points than the material asks for, see --max-lit-points";
  }
  if (bad_samples > 0) {
    line += fmt::format("; {} samples weren't finite and were left out", bad_samples);
  }
  return line;
}

std::string RenderSummary::Table() const {
  return fmt::format(
      "triangles        {:>12}\n"
      "lights           {:>12}\n"
      "lit points       {:>12}{}\n"
      "  skipped        {:>12}\n"
      "rays             {:>12}\n"
      "shadow rays      {:>12}\n"
      "exitances        {:>12}\n"
      "evaluations      {:>12}\n"
      "pairs            {:>12}\n"
      "windows          {:>12} of {}\n"
      "tiles            {:>12} of {}\n"
      "terms            {:>12} of {}\n"
      "channels read    {:>12}\n"
      "probes           {:>12}{}\n"
      "relative error   {:>12.4f}\n"
      "bad samples      {:>12}\n"
      "clamped samples  {:>12}\n"
      "tree             {:>10.2f} s\n"
      "seen             {:>10.2f} s\n"
      "irradiance       {:>10.2f} s\n"
      "models           {:>10.2f} s\n"
      "paths            {:>10.2f} s\n"
      "CPU              {:>10.2f} s",
      triangles,
      lights,
      lit_points,
      lit_points_capped ? " (capped)" : "",
      lit_points_skipped,
      rays,
      shadow_rays,
      exitances,
      evaluations,
      pairs,
      use.windows,
      use.windows_total,
      use.tiles,
      use.tiles_total,
      use.terms,
      use.terms_total,
      use.channels,
      probes,
      probes_cut > 0 ? fmt::format(" ({} cut short)", probes_cut) : "",
      relative_error,
      bad_samples,
      clamped_samples,
      build_s,
      seen_s,
      irradiance_s,
      models_s,
      paths_s,
      cpu_s);
}

Json RenderSummary::ToJson() const {
  return {{"width", width},
          {"height", height},
          {"spp", samples_per_pixel},
          {"spp_least", samples_least},
          {"spp_most", samples_most},
          {"spp_resumed", samples_resumed},
          {"threads", thread_count_used},
          {"time_ran_out", time_ran_out},
          {"relative_error", relative_error},
          {"triangles", triangles},
          {"lights", lights},
          {"lit_points", lit_points},
          {"lit_points_skipped", lit_points_skipped},
          {"lit_points_capped", lit_points_capped},
          {"rays", rays},
          {"shadow_rays", shadow_rays},
          {"exitances", exitances},
          {"evaluations", evaluations},
          {"pairs", pairs},
          {"probes", probes},
          {"probes_cut", probes_cut},
          {"windows", use.windows},
          {"windows_total", use.windows_total},
          {"tiles", use.tiles},
          {"tiles_total", use.tiles_total},
          {"channels_read", use.channels},
          {"terms", use.terms},
          {"terms_total", use.terms_total},
          {"bad_samples", bad_samples},
          {"clamped_samples", clamped_samples},
          {"invariants", invariants.ToJson()},
          {"seconds",
           {{"build", build_s},
            {"seen", seen_s},
            {"irradiance", irradiance_s},
            {"models", models_s},
            {"paths", paths_s}}},
          {"cpu_seconds", cpu_s}};
}

}  // namespace nacre::render
