#include "reconstruct/edit/edit.h"

#include "core/error.h"
#include "reconstruct/edit/edited_profile.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <map>
#include <numeric>

namespace nacre::reconstruct {
namespace {

// E(x, ·) of every point of the edited grid, a row of points at a time; keeps the rows
// that the current one needs.
class EditedRows {
 public:
  EditedRows(const SliceSource& source, const Edit& edit)
      : source_(source), edit_(edit), header_(source.header) {
    header_.points_x -= edit.tile_overlap;
    header_.points_y -= edit.tile_overlap;
  }

  const RdHeader& header() const { return header_; }
  bool IsPeriodic() const { return edit_.tile_overlap > 0; }

  // Makes what row j needs, and forgets the rest.
  void MoveTo(int j) {
    std::map<int, Row> wanted;
    for (int k = j - header_.Radius(); k <= j + header_.Radius(); ++k) {
      const int row = Wrapped(k, header_.points_y);
      if (row < 0 || wanted.contains(row)) {
        continue;
      }
      const auto have = rows_.find(row);
      wanted[row] = have != rows_.end() ? std::move(have->second) : MakeRow(row);
    }
    rows_ = std::move(wanted);
  }

  // Joined slice of a point of the current row, before energy is bounded.
  RdSlice Join(int i, int j) const {
    RdSlice slice = MakeSlice(header_);
    const int radius = header_.Radius();
    const auto size = static_cast<std::size_t>(header_.WindowSize());
    const RdSlice& mine = rows_.at(j)[static_cast<std::size_t>(i)];
    std::fill(slice.sigma.begin(), slice.sigma.end(), 0.0f);
    slice.rd = mine.rd;
    slice.valid = mine.valid;
    for (int v = 0; v < header_.core; ++v) {
      const int to_j = Wrapped(j + v - radius, header_.points_y);
      for (int u = 0; u < header_.core; ++u) {
        const int to_i = Wrapped(i + u - radius, header_.points_x);
        if (to_i < 0 || to_j < 0) {
          continue;
        }
        const RdSlice& theirs = rows_.at(to_j)[static_cast<std::size_t>(to_i)];
        const auto there = static_cast<std::size_t>(std::int64_t{v} * header_.core + u);
        const std::size_t back = size - 1 - there;
        for (std::size_t c = 0; c < header_.channels.size(); ++c) {
          float& value = slice.rd[c * size + there];
          // In double: a float's product would be 0 or infinite long before its root.
          value = static_cast<float>(
              std::sqrt(static_cast<double>(value) *
                        static_cast<double>(theirs.rd[c * size + back])));
        }
      }
    }
    return slice;
  }

  int Wrapped(int k, int count) const {
    if (IsPeriodic()) {
      return (k % count + count) % count;
    }
    return k < 0 || k >= count ? -1 : k;
  }

 private:
  using Row = std::vector<RdSlice>;

  Row MakeRow(int j) const {
    Row row;
    for (int i = 0; i < header_.points_x; ++i) {
      row.push_back(IsPeriodic() ? Blended(i, j) : Edited(i, j));
    }
    return row;
  }

  static float At(const std::vector<float>& values, std::int64_t point) {
    return values.empty() ? 1.0f : values[static_cast<std::size_t>(point)];
  }

  RdSlice Edited(int i, int j) const {
    const RdHeader& from = source_.header;
    const std::int64_t point = std::int64_t{j} * from.points_x + i;
    const auto size = static_cast<std::size_t>(from.WindowSize());
    RdSlice slice = source_.slice(i, j);
    const float share = edit_.mix.empty() ? 0.0f : At(edit_.mix, point);
    const RdSlice other = share > 0 ? edit_.other->slice(i, j) : RdSlice();
    for (int c = 0; c < static_cast<int>(from.channels.size()); ++c) {
      Profile profile = FilledProfile(from, slice, c);
      if (share > 0) {
        const Profile second = FilledProfile(from, other, c);
        for (std::size_t k = 0; k < size; ++k) {
          profile[k] += share * (second[k] - profile[k]);
        }
      }
      if (const float range = At(edit_.range, point); range != 1.0f) {
        profile = Stretched(from, profile, static_cast<double>(range));
      }
      if (const float shape = At(edit_.shape, point); shape != 1.0f) {
        profile = Reshaped(profile, static_cast<double>(shape));
      }
      const float factor = edit_.albedo.empty()
                               ? 1.0f
                               : At(edit_.albedo[static_cast<std::size_t>(c)], point);
      for (std::size_t k = 0; k < size; ++k) {
        slice.rd[static_cast<std::size_t>(c) * size + k] = factor * profile[k];
      }
    }
    std::fill(slice.valid.begin(), slice.valid.end(), std::uint8_t{1});
    return slice;
  }

  // The point of a repeating sample: near its left and upper border, what lies beyond
  // the right and lower one fades out as this fades in.
  RdSlice Blended(int i, int j) const {
    const auto weight = [&](int k) {
      if (k >= edit_.tile_overlap) {
        return 1.0;
      }
      const double t = (k + 0.5) / edit_.tile_overlap;
      return t * t * (3 - 2 * t);
    };
    RdSlice sum;
    for (int part = 0; part < 4; ++part) {
      const bool right = part % 2 != 0;
      const bool below = part / 2 != 0;
      const double share =
          (right ? 1 - weight(i) : weight(i)) * (below ? 1 - weight(j) : weight(j));
      if (share <= 0) {
        continue;
      }
      const RdSlice slice = Edited(i + (right ? header_.points_x : 0),
                                   j + (below ? header_.points_y : 0));
      if (sum.rd.empty()) {
        sum = slice;
        std::fill(sum.rd.begin(), sum.rd.end(), 0.0f);
      }
      for (std::size_t k = 0; k < sum.rd.size(); ++k) {
        sum.rd[k] += static_cast<float>(share) * slice.rd[k];
      }
    }
    return sum;
  }

  const SliceSource& source_;
  const Edit& edit_;
  RdHeader header_;
  std::map<int, Row> rows_;
};

void CheckEdit(const SliceSource& source, const Edit& edit) {
  const RdHeader& a = source.header;
  if (edit.other != nullptr) {
    const RdHeader& b = edit.other->header;
    if (a.points_x != b.points_x || a.points_y != b.points_y || a.core != b.core ||
        a.channels != b.channels || std::abs(a.pitch_mm - b.pitch_mm) > 1e-6) {
      throw BadData(fmt::format(
          "the samples to mix have different grids: {} x {} points, core {}, {} mm and "
          "{} x {}, {}, {} mm",
          a.points_x,
          a.points_y,
          a.core,
          a.pitch_mm,
          b.points_x,
          b.points_y,
          b.core,
          b.pitch_mm));
    }
  }
  const int left = std::min(a.points_x, a.points_y) - edit.tile_overlap;
  if (edit.tile_overlap > 0 && (left < a.core || left < edit.tile_overlap)) {
    throw BadData(fmt::format(
        "an overlap of {} points leaves {} of {}; at least {} (its core, and the "
        "overlap) must be left",
        edit.tile_overlap,
        left,
        std::min(a.points_x, a.points_y),
        std::max(a.core, edit.tile_overlap)));
  }
}

// Σ R pitch² of each slice and channel, joined: [point][channel].
std::vector<double> TotalsOf(EditedRows& rows, const ProgressFunction& progress) {
  const RdHeader& header = rows.header();
  const auto size = header.WindowSize();
  std::vector<double> totals;
  for (int j = 0; j < header.points_y; ++j) {
    Report(progress, {"edit", j, std::int64_t{2} * header.points_y, "totals"});
    rows.MoveTo(j);
    for (int i = 0; i < header.points_x; ++i) {
      const RdSlice slice = rows.Join(i, j);
      for (std::size_t c = 0; c < header.channels.size(); ++c) {
        const auto begin = slice.rd.begin() + static_cast<std::ptrdiff_t>(c) * size;
        totals.push_back(std::accumulate(begin, begin + size, 0.0) *
                         header.CellAreaMm2());
      }
    }
  }
  return totals;
}

// Divides each pair by the larger total of its two ends where that is above 1.
void BoundEnergy(const EditedRows& rows,
                 const std::vector<double>& totals,
                 int i,
                 int j,
                 RdSlice& slice) {
  const RdHeader& header = rows.header();
  const std::size_t channels = header.channels.size();
  const auto size = static_cast<std::size_t>(header.WindowSize());
  const auto total = [&](int x, int y, std::size_t c) {
    return totals[static_cast<std::size_t>(y * header.points_x + x) * channels + c];
  };
  for (std::size_t c = 0; c < channels; ++c) {
    for (int v = 0; v < header.core; ++v) {
      const int to_j = rows.Wrapped(j + v - header.Radius(), header.points_y);
      for (int u = 0; u < header.core; ++u) {
        const int to_i = rows.Wrapped(i + u - header.Radius(), header.points_x);
        double largest = std::max(1.0, total(i, j, c));
        if (to_i >= 0 && to_j >= 0) {
          largest = std::max(largest, total(to_i, to_j, c));
        }
        slice.rd[c * size + static_cast<std::size_t>(v * header.core + u)] /=
            static_cast<float>(largest);
      }
    }
  }
}

}  // namespace

EditSummary WriteEdited(const SliceSource& source,
                        const Edit& edit,
                        const std::string& provenance,
                        const std::filesystem::path& out,
                        const ProgressFunction& progress) {
  CheckEdit(source, edit);
  EditedRows rows(source, edit);
  RdHeader header = rows.header();
  header.provenance = provenance;
  const std::vector<double> totals = TotalsOf(rows, progress);
  EditSummary summary{.points_x = header.points_x, .points_y = header.points_y};
  summary.largest_total = *std::max_element(totals.begin(), totals.end());
  summary.bounded =
      std::count_if(totals.begin(), totals.end(), [](double t) { return t > 1; });
  RdWriter writer(out, header);
  for (int j = 0; j < header.points_y; ++j) {
    Report(progress,
           {"edit", header.points_y + j, std::int64_t{2} * header.points_y, "writing"});
    rows.MoveTo(j);
    for (int i = 0; i < header.points_x; ++i) {
      RdSlice slice = rows.Join(i, j);
      if (summary.bounded > 0) {
        BoundEnergy(rows, totals, i, j, slice);
      }
      writer.WriteSlice(i, j, slice);
    }
  }
  writer.Finish();
  return summary;
}

}  // namespace nacre::reconstruct
