// Slices that are equal are factored once: their matrix has one row for each set, which
// counts as often as there are slices.

#include "factor/internal/equal_rows.h"

#include "core/hash.h"
#include "reconstruct/clustering.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <unordered_map>

namespace nacre::factor::internal {
namespace {

constexpr std::int64_t kLooks = 128;  // slices

std::string HashOf(const SliceBlock& block, std::int64_t row, std::int64_t size) {
  const auto bytes = static_cast<std::size_t>(size);
  return HashHex(block.rd + row * size, bytes * sizeof(float)) +
         HashHex(block.valid + row * size, bytes);
}

bool SomeAreEqual(SliceSource& source) {
  const std::int64_t points = source.header().PointCount();
  const std::int64_t size = source.header().SliceSize();
  const std::int64_t looks = std::min(points, kLooks);
  std::set<std::string> seen;
  for (std::int64_t n = 0; n < looks; ++n) {
    if (!seen.insert(HashOf(source.Read(n * points / looks, 1), 0, size)).second) {
      return true;
    }
  }
  return false;
}

// An SVD's material of the distinct slices, given to all points.
Material ToAllPoints(const Material& few,
                     const EqualRows& rows,
                     const reconstruct::RdHeader& header) {
  Material m = few;
  m.points_x = header.points_x;
  m.points_y = header.points_y;
  const auto spread = [&](const auto& from, auto& to) {
    const std::size_t planes = from.size() / rows.first.size();
    to.clear();
    for (std::size_t plane = 0; plane < planes; ++plane) {
      for (const std::int64_t set : rows.set) {
        to.push_back(from[plane * rows.first.size() + static_cast<std::size_t>(set)]);
      }
    }
  };
  spread(few.f, m.f);
  spread(few.cluster, m.cluster);
  spread(few.row_scale, m.row_scale);
  spread(few.albedo, m.albedo);
  return m;
}

class DistinctSvdMethod final : public Method {
 public:
  explicit DistinctSvdMethod(Job& job)
      : job_(job),
        clusterer_([&job](const reconstruct::ClusterOptions&, const ProgressFunction&) {
          reconstruct::Clustering clustering = ClusterSlices(job);
          std::vector<std::uint8_t> labels;
          for (const std::int64_t first : job.distinct->rows().first) {
            labels.push_back(clustering.labels[static_cast<std::size_t>(first)]);
          }
          clustering.labels = std::move(labels);
          return clustering;
        }),
        few_{*job.distinct,
             job.options,
             job.progress,
             clusterer_,
             job.sample,
             job.scans} {
    for (std::int64_t& row : few_.sample.rows) {
      row = job.distinct->rows().set[static_cast<std::size_t>(row)];
    }
    method_ = MakeSvdMethod(few_);
  }

  int MostTerms() const override { return method_->MostTerms(); }
  Material Make(int terms) override {
    return ToAllPoints(
        method_->Make(terms), job_.distinct->rows(), job_.source.header());
  }
  void Describe(FactorSummary& summary) const override { method_->Describe(summary); }

 private:
  Job& job_;
  Clusterer clusterer_;
  Job few_;
  std::unique_ptr<Method> method_;
};

}  // namespace

std::optional<EqualRows> FindEqualRows(SliceSource& source,
                                       const ProgressFunction& progress) {
  const std::int64_t points = source.header().PointCount();
  const std::int64_t size = source.header().SliceSize();
  const std::int64_t most = std::min(points / 2, kMostDistinctRows);
  if (!SomeAreEqual(source)) {
    return std::nullopt;
  }
  EqualRows rows;
  std::unordered_map<std::string, std::int64_t> sets;
  for (std::int64_t first = 0; first < points; first += kBlockRows) {
    Report(progress, {"factor", first, points, "equal slices"});
    const SliceBlock block = source.Read(first, std::min(kBlockRows, points - first));
    for (std::int64_t row = 0; row < block.count; ++row) {
      const float* rd = block.rd + row * size;
      const auto [found, is_new] =
          sets.try_emplace(HashOf(block, row, size), std::ssize(rows.first));
      if (is_new) {
        if (std::ssize(rows.first) == most ||
            !std::all_of(rd, rd + size, [](float r) { return std::isfinite(r); })) {
          return std::nullopt;
        }
        rows.first.push_back(first + row);
        rows.count.push_back(0);
      }
      ++rows.count[static_cast<std::size_t>(found->second)];
      rows.set.push_back(found->second);
    }
  }
  return rows;
}

DistinctRows::DistinctRows(SliceSource& source, EqualRows rows)
    : source_(source), rows_(std::move(rows)), header_(source.header()) {
  header_.points_x = static_cast<int>(rows_.first.size());
  header_.points_y = 1;
}

SliceBlock DistinctRows::Read(std::int64_t first, std::int64_t count) {
  const std::int64_t size = header_.SliceSize();
  rd_.clear();
  valid_.clear();
  for (std::int64_t n = first; n < first + count; ++n) {
    const SliceBlock one = source_.Read(rows_.first[static_cast<std::size_t>(n)], 1);
    rd_.insert(rd_.end(), one.rd, one.rd + size);
    valid_.insert(valid_.end(), one.valid, one.valid + size);
  }
  return {first,
          count,
          rd_.data(),
          valid_.data(),
          nullptr,
          &rows_.count[static_cast<std::size_t>(first)]};
}

std::unique_ptr<Method> MakeDistinctSvdMethod(Job& job) {
  return std::make_unique<DistinctSvdMethod>(job);
}

}  // namespace nacre::factor::internal
