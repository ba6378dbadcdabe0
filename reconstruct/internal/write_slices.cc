#include "reconstruct/internal/write_slices.h"

#include "core/error.h"
#include "core/parallel.h"
#include "core/ranks.h"
#include "reconstruct/internal/fill_diagonal.h"
#include "reconstruct/internal/glare_floor.h"
#include "reconstruct/internal/symmetrize.h"
#include "reconstruct/internal/systematics.h"

#include <algorithm>
#include <cstring>
#include <fmt/format.h>
#include <future>
#include <type_traits>
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

using Batch = std::vector<Finished>;

constexpr std::int64_t kAtOnce = 64;
constexpr int kTag = 1;

Batch FinishBatch(const Separation& separation,
                  const Finishing& finishing,
                  const ReconstructOptions& options,
                  std::int64_t first) {
  Batch batch(static_cast<std::size_t>(
      std::min(kAtOnce, finishing.header.PointCount() - first)));
  ParallelFor(std::ssize(batch), options.thread_count, [&](std::int64_t k) {
    batch[static_cast<std::size_t>(k)] =
        Finish(separation, finishing, options, first + k);
  });
  return batch;
}

// Who works on which batch: always who has least to do, the root having to write all.
std::vector<int> OwnersOf(std::int64_t slices, const Ranks* ranks) {
  constexpr double kWriting = 0.3;  // of a batch's work, about
  const std::int64_t batches = (slices + kAtOnce - 1) / kAtOnce;
  std::vector<double> load(ranks == nullptr ? 1
                                            : static_cast<std::size_t>(ranks->size()));
  std::vector<int> owners;
  for (std::int64_t batch = 0; batch < batches; ++batch) {
    const auto least = std::min_element(load.begin(), load.end());
    owners.push_back(static_cast<int>(least - load.begin()));
    *least += 1;
    load[0] += kWriting;
  }
  return owners;
}

std::string Pack(const Batch& batch) {
  static_assert(std::is_trivially_copyable_v<Findings>);
  std::string bytes;
  for (const auto& [slice, findings] : batch) {
    bytes += ToBytes(std::span<const Findings>(&findings, 1));
    bytes += ToBytes(std::span<const float>(slice.rd));
    bytes += ToBytes(std::span<const float>(slice.sigma));
    bytes += ToBytes(std::span<const std::uint8_t>(slice.valid));
  }
  return bytes;
}

template <class T>
void Take(const char*& from, std::span<T> to) {
  std::memcpy(to.data(), from, to.size_bytes());
  from += to.size_bytes();
}

Batch Unpack(const std::string& bytes, const RdHeader& header) {
  const auto values = static_cast<std::size_t>(header.SliceSize());
  const std::size_t each =
      sizeof(Findings) + values * (2 * sizeof(float) + sizeof(std::uint8_t));
  Expect(bytes.size() % each == 0, "whole slices from another rank");
  Batch batch(bytes.size() / each);
  const char* at = bytes.data();
  for (auto& [slice, findings] : batch) {
    slice = MakeSlice(header);
    Take(at, std::span<Findings>(&findings, 1));
    Take(at, std::span<float>(slice.rd));
    Take(at, std::span<float>(slice.sigma));
    Take(at, std::span<std::uint8_t>(slice.valid));
  }
  return batch;
}

}  // namespace

void SendSlices(const Separation& separation,
                const Finishing& finishing,
                const ReconstructOptions& options,
                const ProgressFunction& progress) {
  const std::int64_t total = finishing.header.PointCount();
  const std::vector<int> owners = OwnersOf(total, options.ranks);
  for (std::int64_t first = 0; first < total; first += kAtOnce) {
    if (owners[static_cast<std::size_t>(first / kAtOnce)] == options.ranks->rank()) {
      Report(progress, {"reconstruct", first, total, "slices"});
      std::string bytes = Pack(FinishBatch(separation, finishing, options, first));
      options.ranks->Flush();  // no more than one on its way and one being made
      options.ranks->Post(0, kTag, std::move(bytes));
    }
  }
  options.ranks->Flush();
}

void WriteSlices(const Separation& separation,
                 const Finishing& finishing,
                 const ReconstructOptions& options,
                 RdWriter& writer,
                 ReconstructSummary& summary,
                 const ProgressFunction& progress) {
  const std::int64_t total = finishing.header.PointCount();
  const int width = finishing.header.points_x;
  const std::vector<int> owners = OwnersOf(total, options.ranks);
  SymmetrizeChange change;
  ExposureAdvice::Counts dim;
  Batch written;
  std::future<void> writing;  // declared last: it is waited for before `written` goes
  for (std::int64_t first = 0; first < total; first += kAtOnce) {
    Report(progress, {"reconstruct", first, total, "slices"});
    const int owner = owners[static_cast<std::size_t>(first / kAtOnce)];
    Batch batch = owner == 0 ? FinishBatch(separation, finishing, options, first)
                             : Unpack(options.ranks->Receive(kTag, owner).bytes,
                                      finishing.header);
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
