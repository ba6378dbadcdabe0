#include "reconstruct/error_figures.h"

#include "core/error.h"
#include "core/json.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <limits>

namespace nacre::reconstruct {
namespace {

std::string Describe(const RdHeader& header) {
  return fmt::format("{} x {} points, core {}, pitch {} mm, channels {}",
                     header.points_x,
                     header.points_y,
                     header.core,
                     header.pitch_mm,
                     fmt::join(header.channels, " "));
}

void CheckAlike(const RdHeader& a, const RdHeader& b) {
  const bool same_pitch = std::abs(a.pitch_mm - b.pitch_mm) <= 1e-6 * a.pitch_mm;
  if (a.points_x != b.points_x || a.points_y != b.points_y || a.core != b.core ||
      !same_pitch || a.channels != b.channels) {
    throw BadData(fmt::format("cannot compare {} with {}", Describe(a), Describe(b)));
  }
}

double FindPeak(const SliceSource& a, const ProgressFunction& progress) {
  double peak = 0;
  for (int j = 0; j < a.header.points_y; ++j) {
    Report(progress, {"compare", j, 2 * a.header.points_y, ""});
    for (int i = 0; i < a.header.points_x; ++i) {
      const RdSlice slice = a.slice(i, j);
      for (std::size_t k = 0; k < slice.rd.size(); ++k) {
        peak = slice.valid[k] != 0 ? std::max(peak, static_cast<double>(slice.rd[k]))
                                   : peak;
      }
    }
  }
  return peak;
}

// A ratio whose denominator may be nothing: equal nothings are no error.
double Relative(double difference, double reference) {
  if (reference != 0) {
    return difference / reference;
  }
  return difference == 0 ? 0 : std::numeric_limits<double>::infinity();
}

class Comparison {
 public:
  explicit Comparison(double peak) {
    figures_.peak = peak;
    figures_.log_floor = kLogFloor * peak;
  }

  // One slice; sums of a channel first, so that they round alike for any size.
  void Add(const RdHeader& header, int i, int j, const RdSlice& a, const RdSlice& b) {
    const auto window = static_cast<std::size_t>(header.WindowSize());
    for (std::size_t c = 0; c < header.channels.size(); ++c) {
      const Sums sums = SumsOf(a, b, c * window, (c + 1) * window);
      NoteWorst(sums, i, j);
      figures_.max_albedo_a =
          std::max(figures_.max_albedo_a, sums.all_a * header.CellAreaMm2());
      figures_.max_albedo_b =
          std::max(figures_.max_albedo_b, sums.all_b * header.CellAreaMm2());
      squares_a_ += sums.squares_a;
      squares_difference_ += sums.squares_difference;
      total_a_ += sums.total_a;
      total_b_ += sums.total_b;
    }
  }

  ErrorFigures Finish() {
    ErrorFigures& f = figures_;
    const double count = std::max(1.0, static_cast<double>(f.value_count));
    f.rmse = std::sqrt(squares_difference_ / count);
    f.relative_l2 = Relative(std::sqrt(squares_difference_), std::sqrt(squares_a_));
    f.rmse_over_mean = Relative(f.rmse, total_a_ / count);
    f.psnr_db = f.rmse > 0 ? 20 * std::log10(f.peak / f.rmse)
                           : std::numeric_limits<double>::infinity();
    f.log_rms = f.log_count > 0
                    ? std::sqrt(squares_log_ / static_cast<double>(f.log_count))
                    : 0;
    f.energy_ratio = total_a_ != 0 ? total_b_ / total_a_ : 1;
    return f;
  }

 private:
  struct Sums {
    double squares_a = 0;
    double squares_difference = 0;
    double total_a = 0;
    double total_b = 0;
    double all_a = 0;  // valid or not in the other
    double all_b = 0;
  };

  Sums SumsOf(const RdSlice& a, const RdSlice& b, std::size_t begin, std::size_t end) {
    Sums sums;
    for (std::size_t k = begin; k < end; ++k) {
      const auto x = static_cast<double>(a.rd[k]);
      const auto y = static_cast<double>(b.rd[k]);
      sums.all_a += a.valid[k] != 0 ? x : 0;
      sums.all_b += b.valid[k] != 0 ? y : 0;
      if (a.valid[k] == 0 || b.valid[k] == 0) {
        ++figures_.invalid_count;
        continue;
      }
      ++figures_.value_count;
      sums.squares_a += x * x;
      sums.squares_difference += (y - x) * (y - x);
      sums.total_a += x;
      sums.total_b += y;
      if (x > figures_.log_floor) {
        const double log_ratio = std::log(std::max(y, figures_.log_floor) / x);
        squares_log_ += log_ratio * log_ratio;
        ++figures_.log_count;
      }
    }
    return sums;
  }

  void NoteWorst(const Sums& sums, int i, int j) {
    const double slice =
        Relative(std::sqrt(sums.squares_difference), std::sqrt(sums.squares_a));
    if (slice > figures_.worst_slice) {
      figures_.worst_slice = slice;
      figures_.worst_slice_i = i;
      figures_.worst_slice_j = j;
    }
    const double total =
        Relative(std::abs(sums.total_b - sums.total_a), std::abs(sums.total_a));
    if (total > figures_.worst_total) {
      figures_.worst_total = total;
      figures_.worst_total_i = i;
      figures_.worst_total_j = j;
    }
  }

  ErrorFigures figures_;
  double squares_a_ = 0;
  double squares_difference_ = 0;
  double squares_log_ = 0;
  double total_a_ = 0;
  double total_b_ = 0;
};

// JSON has no infinity; equal inputs have an infinite PSNR.
Json Number(double value) {
  return std::isfinite(value) ? Json(value) : Json("inf");
}

}  // namespace

ErrorFigures CompareSlices(const SliceSource& a,
                           const SliceSource& b,
                           const ProgressFunction& progress) {
  CheckAlike(a.header, b.header);
  Comparison comparison(FindPeak(a, progress));
  const int rows = a.header.points_y;
  for (int j = 0; j < rows; ++j) {
    Report(progress, {"compare", rows + j, 2 * rows, ""});
    for (int i = 0; i < a.header.points_x; ++i) {
      comparison.Add(a.header, i, j, a.slice(i, j), b.slice(i, j));
    }
  }
  Report(progress, {"compare", 2 * rows, 2 * rows, ""});
  return comparison.Finish();
}

Json ErrorFigures::ToJson() const {
  return {{"values", value_count},
          {"invalid", invalid_count},
          {"relative_l2", Number(relative_l2)},
          {"rmse", rmse},
          {"rmse_over_mean", Number(rmse_over_mean)},
          {"peak", peak},
          {"psnr_db", Number(psnr_db)},
          {"log_rms", log_rms},
          {"log_floor", log_floor},
          {"log_values", log_count},
          {"worst_slice", Number(worst_slice)},
          {"worst_slice_at", {worst_slice_i, worst_slice_j}},
          {"worst_total", Number(worst_total)},
          {"worst_total_at", {worst_total_i, worst_total_j}},
          {"energy_ratio", energy_ratio},
          {"max_albedo_a", max_albedo_a},
          {"max_albedo_b", max_albedo_b}};
}

std::string ErrorFigures::ToString(const std::string& unit) const {
  std::string text;
  const auto line = [&](const char* name, const std::string& value) {
    text += fmt::format("{:<16}{}\n", name, value);
  };
  line("relative L2", fmt::format("{:.6g}", relative_l2));
  line("RMSE",
       fmt::format("{:.6g} {} ({:.6g} of the mean)", rmse, unit, rmse_over_mean));
  line("PSNR", fmt::format("{:.2f} dB, peak {:.6g} {}", psnr_db, peak, unit));
  line("log RMS",
       fmt::format("{:.6g}, of ln, {} values above {:.3g} {}",
                   log_rms,
                   log_count,
                   log_floor,
                   unit));
  line("worst slice",
       fmt::format("{:.6g} at ({}, {})", worst_slice, worst_slice_i, worst_slice_j));
  line("worst total",
       fmt::format("{:.6g} at ({}, {})", worst_total, worst_total_i, worst_total_j));
  line("energy", fmt::format("{:.6g} of the reference's", energy_ratio));
  line("largest albedo", fmt::format("{:.6g} and {:.6g}", max_albedo_a, max_albedo_b));
  line("compared",
       fmt::format(
           "{} values; {} not valid in one of the two", value_count, invalid_count));
  return text;
}

}  // namespace nacre::reconstruct
