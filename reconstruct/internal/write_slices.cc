#include "reconstruct/internal/write_slices.h"

#include "core/parallel.h"
#include "reconstruct/internal/fill_diagonal.h"
#include "reconstruct/internal/glare_floor.h"
#include "reconstruct/internal/symmetrize.h"
#include "reconstruct/internal/systematics.h"

#include <algorithm>
#include <fmt/format.h>
#include <future>
#include <utility>

namespace nacre::reconstruct::internal {
namespace {

// What is to be known of a slice beside its values.
struct Findings {
  double foreign_share = 0;
  std::int64_t invalid = 0;
  std::int64_t below_floor = 0;
  SymmetrizeChange change;
  ExposureAdvice::Counts dim;
};

struct Finished {
  RdSlice slice;
  Findings findings;
};

Finished Finish(const Separation& separation,
                const Finishing& finishing,
                const ReconstructOptions& options,
                std::int64_t s) {
  const RdHeader& header = finishing.header;
  Findings findings;
  RdSlice slice = separation.Slice(s, &findings.foreign_share);
  if (options.symmetrize) {
    findings.change = Symmetrize(header, separation, s, slice);
  }
  // First: what scales a slice, as its power's ripple does, scales gloss as well.
  if (options.state_systematics) {
    AddSystematics(header, finishing.calibration, finishing.longest_us, slice);
  }
  finishing.gloss.Remove(s, slice);
  if (options.specular_radius_cells >= 0) {
    FillDiagonal(header, options.specular_radius_cells, slice);
  }
  findings.below_floor = MarkBelowFloor(header, separation.Floor(s), slice);
  findings.dim = finishing.advice.Look(slice);
  findings.invalid = std::count(slice.valid.begin(), slice.valid.end(), 0);
  return {std::move(slice), findings};
}

}  // namespace

void WriteSlices(const Separation& separation,
                 const Finishing& finishing,
                 const ReconstructOptions& options,
                 RdWriter& writer,
                 ReconstructSummary& summary,
                 const ProgressFunction& progress) {
  constexpr std::int64_t kAtOnce = 64;
  const std::int64_t total = finishing.header.PointCount();
  const int width = finishing.header.points_x;
  SymmetrizeChange change;
  ExposureAdvice::Counts dim;
  std::vector<Finished> written;
  std::future<void> writing;  // declared last: it is waited for before `written` goes
  for (std::int64_t first = 0; first < total; first += kAtOnce) {
    Report(progress, {"reconstruct", first, total, "slices"});
    std::vector<Finished> batch(
        static_cast<std::size_t>(std::min(kAtOnce, total - first)));
    ParallelFor(std::ssize(batch), options.thread_count, [&](std::int64_t k) {
      batch[static_cast<std::size_t>(k)] =
          Finish(separation, finishing, options, first + k);
    });
    for (const auto& [slice, findings] : batch) {
      summary.max_crosstalk = std::max(summary.max_crosstalk, findings.foreign_share);
      summary.invalid_count += findings.invalid;
      summary.below_floor_count += findings.below_floor;
      change.Add(findings.change);
      dim.Add(findings.dim);
    }
    if (writing.valid()) {
      writing.get();
    }
    written = std::move(batch);
    writing = std::async(std::launch::async, [&writer, &written, first, width] {
      std::int64_t s = first;
      for (const Finished& one : written) {
        writer.WriteSlice(
            static_cast<int>(s % width), static_cast<int>(s / width), one.slice);
        ++s;
      }
    });
  }
  if (writing.valid()) {
    writing.get();
  }
  if (std::string text = finishing.advice.Warning(dim); !text.empty()) {
    summary.warnings.push_back(std::move(text));
  }
  if (summary.below_floor_count > 0) {
    summary.warnings.push_back(fmt::format(
        "glare-floor: {} of {} values are below what glare leaves uncertain "
        "and are marked as not valid",
        summary.below_floor_count,
        total * finishing.header.SliceSize()));
  }
  summary.symmetrize_change = change.Share();
  summary.symmetrize_worst_total = change.worst_total;
  Report(progress, {"reconstruct", total, total, "slices"});
}

}  // namespace nacre::reconstruct::internal
