#include "core/json.h"
#include "factor/factor.h"

#include <cmath>
#include <fmt/format.h>

namespace nacre::factor {

std::string FactorSummary::Brief() const {
  return fmt::format(
      "{} terms, {:.3g} MB ({:.0f} times smaller), relative L2 error {:.3g} %, log "
      "error "
      "{:.3g}, PSNR {:.1f} dB, {:.2f} s ({:.2f} s of CPU)",
      terms,
      static_cast<double>(bytes) / 1e6,
      static_cast<double>(dataset_bytes) / static_cast<double>(bytes),
      100 * relative_l2,
      log_rms,
      psnr_db,
      seconds,
      cpu_seconds);
}

Json FactorSummary::ToJson() const {
  Json curve = Json::array();
  for (const TermsError& point : error_curve) {
    curve.push_back({{"terms", point.terms},
                     {"relative_l2", point.relative_l2},
                     {"log_rms", point.log_rms}});
  }
  return {{"bytes", bytes},
          {"dataset_bytes", dataset_bytes},
          {"terms", terms},
          {"clusters", clusters},
          {"bits", bits},
          {"added_l2", added_l2},
          {"added_log", added_log},
          {"relative_l2", relative_l2},
          {"rmse_over_mean", rmse_over_mean},
          {"log_rms", log_rms},
          {"psnr_db", std::isfinite(psnr_db) ? Json(psnr_db) : Json()},
          {"peak", peak},
          {"measured_slices", measured_slices},
          {"factored_slices", factored_slices},
          {"worst_slice", worst_slice},
          {"worst_slice_at", {worst_slice_i, worst_slice_j}},
          {"worst_total", worst_total},
          {"a", a},
          {"b", b},
          {"missing_fraction", missing_fraction},
          {"unfit_slices", unfit_slices},
          {"cpu_seconds", cpu_seconds},
          {"seconds", seconds},
          {"passes", passes},
          {"rounds", rounds},
          {"search_steps", search_steps},
          {"working_bytes", working_bytes},
          {"error_curve", curve},
          {"invariants", invariants.ToJson()},
          {"notes", notes}};
}

}  // namespace nacre::factor
