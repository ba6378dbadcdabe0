#pragma once

#include "factor/factor.h"
#include "factor/internal/mean_slice.h"
#include "factor/internal/row_lots.h"
#include "factor/internal/slice_source.h"
#include "factor/internal/workers.h"

#include <functional>
#include <memory>
#include <vector>

namespace nacre::reconstruct {
struct ClusterOptions;
struct Clustering;
}  // namespace nacre::reconstruct

namespace nacre::factor::internal {

/// Slices on which parameters are tried, as a dataset of one row of points.
struct Sample {
  reconstruct::RdDataset dataset;
  std::vector<std::int64_t> rows;  ///< their numbers in the whole dataset
};

/// One of every count / `wanted` slices, at a random place in its stretch, so that the
/// sample covers the whole grid.
Sample TakeSample(SliceSource& source, int wanted, std::uint64_t seed);

using Clusterer = std::function<reconstruct::Clustering(
    const reconstruct::ClusterOptions&, const ProgressFunction&)>;

class DistinctRows;

/// What a method works on and with.
struct Job {
  SliceSource& source;
  const FactorOptions& options;
  const ProgressFunction& progress;
  const Clusterer& clusterer;
  Sample sample;
  std::vector<ChannelScan> scans;
  int passes = 0;  ///< times that all slices were read

  /// Slices that stand for all where these are read only once, beside which `scans` are
  /// theirs until a fit has seen all slices and set `totals`; else empty.
  Sample check = {};
  std::vector<double> totals = {};  ///< [channel][point] Σ R_d of the slices

  /// Where many slices are equal: each of them once; else null.
  DistinctRows* distinct = nullptr;

  /// A material of the same data and method to begin with (reuse.h); else null.
  const Material* made = nullptr;

  ~Job();
  /// The largest measurement of any channel, mm⁻².
  double Peak() const;
};

bool IsSvd(const std::string& method);

inline Workers WorkersOf(const Job& job) {
  return {job.options.thread_count, job.options.ranks};
}

/// Fills `sample` and `scans`, or, where a method can do with one reading of all slices
/// (the SVDs, large data, nothing missing), `sample`, `check` and its scans.
void Look(Job& job);

/// Fills `sample` and `scans` by a reading of all slices; `check` is empty.
void LookAtAll(Job& job);

/// Clusters of the slices: those of `job.made` where they are the same, else by a
/// reading.
reconstruct::Clustering ClusterSlices(Job& job);

/// A reading of this rank's lots of slices, in their order: of_block() for each block
/// of a lot, then end_of_lot().
void ForLots(Job& job,
             const RowLots& lots,
             const char* note,
             const std::function<void(const SliceBlock&)>& of_block,
             const std::function<void()>& end_of_lot);

/// Collective: maps [map][point], of which each rank has the points of its lots, are
/// whole on all.
void JoinMaps(const Job& job, const RowLots& lots, std::vector<float>& maps);

/// A way to make maps and kernels of a dataset.
class Method {
 public:
  virtual ~Method() = default;
  /// No more terms than these make a difference; at most the option's.
  virtual int MostTerms() const = 0;
  /// A material of that many terms, without row_scale and albedo.
  virtual Material Make(int terms) = 0;
  /// Adds what only this method knows.
  virtual void Describe(FactorSummary& summary) const = 0;
};

/// The job must outlive the method.
std::unique_ptr<Method> MakeSvdMethod(Job& job);
std::unique_ptr<Method> MakeBilinearMethod(Job& job);
std::unique_ptr<Method> MakeNmfMethod(Job& job);
std::unique_ptr<Method> MakeReciprocalMethod(Job& job);
std::unique_ptr<Method> MakeTuckerMethod(Job& job);
std::unique_ptr<Method> MakeProfilesMethod(Job& job);

/// Header fields, and row_scale and albedo of the right size.
Material EmptyMaterial(const reconstruct::RdHeader& header);

}  // namespace nacre::factor::internal
