#pragma once

#include "core/json_fwd.h"
#include "core/options.h"
#include "core/progress.h"
#include "factor/invariants.h"
#include "factor/material.h"
#include "reconstruct/rd_dataset.h"

#include <cstdint>
#include <string>
#include <vector>

namespace nacre {
class Ranks;
}

namespace nacre::factor {

/// How a dataset is factored. `thread_count` and `seed` aren't listed in Visit: every
/// verb has them.
struct FactorOptions {
  std::string method = "log-svd";
  int terms = 0;
  int clusters = 1;
  double bytes = 0;
  double error = 0;
  double log_weight = 0;
  int sample_rows = 256;
  int fill_rounds = 2;
  double bits = 0;
  double tail_weight = 1;
  bool one_by_one = false;
  bool divide_falloff = false;
  int check_slices = 4096;
  int polynomial = 3;
  int window_rank = 1;
  int taps = 3;
  int sides = 0;
  int rest = 0;
  double totals = 0.01;
  double memory_mb = 1000;

  int thread_count = 0;          ///< 0: all cores; doesn't change a bit of the result
  const Ranks* ranks = nullptr;  ///< nor do these; all get the same, the root alone the
                                 ///< invariants
  std::uint64_t seed = 1;        ///< of the sample of rows and of the clustering

  template <class Self, class Visitor>
  // NOLINTNEXTLINE(readability-function-size): a list
  static void Visit(Self& self, Visitor&& visit) {
    visit("method",
          self.method,
          Range{},
          "log-svd, svd, sqrt-svd, tucker, nmf, profiles (or gaussian), bilinear, "
          "reciprocal, or auto: the best of those that win for some size");
    visit("terms",
          self.terms,
          Range{0, 1024},
          "terms S a channel (at most); 0: the method's own, which are 10, of bilinear "
          "6, of reciprocal 4");
    visit("clusters", self.clusters, Range{1, 255}, "k-means clusters of slices");
    visit("bytes",
          self.bytes,
          Range{0},
          "fewer terms, for a file of this size at most (300k, 2MB); 0: no limit");
    visit("error",
          self.error,
          Range{0, 1},
          "as few terms as keep this relative L2 error; 0: all terms");
    visit("log_weight",
          self.log_weight,
          Range{0, 100},
          "weight of the log error where A and B are chosen; 0: error in R_d alone");
    visit("sample_rows",
          self.sample_rows,
          Range{8, 1e6},
          "slices that A and B are tried on");
    visit("fill_rounds",
          self.fill_rounds,
          Range{0, 20},
          "times that missing values are predicted and fitted again");
    visit("bits",
          self.bits,
          Range{0, 32},
          "of the values of a factor map, 4 to 16, or 32: floats; 0: as few as add 1 % "
          "to the errors");
    visit("tail_weight",
          self.tail_weight,
          Range{0, 2},
          "of bilinear, nmf and reciprocal: 0 minimises the error in R_d, 1 that over "
          "the root of R_d, 2 that over R_d");
    visit("one_by_one",
          self.one_by_one,
          Range{},
          "of the SVDs: each term from the residual of those before, as the thesis has "
          "it; the same to rounding, and slower");
    visit("divide_falloff",
          self.divide_falloff,
          Range{},
          "of svd and sqrt-svd: slices are divided by the mean slice first, which "
          "counts errors in the tails as those at the peak");
    visit(
        "check_slices",
        self.check_slices,
        Range{0, 1e9},
        "of the SVDs on 8192 slices and more: errors are measured on so many (at "
        "least 4096), with one reading of the data for all; 0: on all of them, by two "
        "more");
    visit("polynomial",
          self.polynomial,
          Range{0, 8},
          "of tucker: order P of what makes a channel of the mean of all");
    visit("window_rank",
          self.window_rank,
          Range{0, 255},
          "of tucker: rank of a kernel along the window's sides; 0: any");
    visit("taps",
          self.taps,
          Range{1, 4},
          "of reciprocal, where maps are looked at between two points: 1 at the points "
          "alone, 2 in the middle, 3 at the quarters, 4 at the eighths too");
    visit(
        "sides",
        self.sides,
        Range{0, 1},
        "of reciprocal: 1 has a map for how light that enters at a point differs from "
        "light that leaves from a cell; R_d without it is the same both ways");
    visit(
        "rest",
        self.rest,
        Range{0, 256},
        "of reciprocal: at most so many maps more, for what those at points can't tell "
        "of a pair; as many as stand out of the noise are kept");
    visit("totals",
          self.totals,
          Range{0, 1},
          "of reciprocal: slices' totals stay within this of the measured ones; 1: as "
          "they come");
    visit(
        "memory_mb",
        self.memory_mb,
        Range{1, 1e6},
        "for pairs of points: reciprocal fits its maps to fewer if these are all that "
        "fit; bilinear needs all of them and says so");
  }
};

/// Names that FactorOptions::method may take, beside "auto".
const std::vector<std::string>& FactorMethods();

/// What was done and how good it is. Errors are over the valid measurements, all
/// channels together, after rounding to floats and with each slice's total corrected.
struct FactorSummary {
  std::int64_t bytes = 0;          ///< of the file
  std::int64_t dataset_bytes = 0;  ///< the measurements as 32-bit floats
  int terms = 0;                   ///< as stored, at most the option's
  int clusters = 0;
  std::vector<double> a;  ///< a channel; empty for the linear model
  std::vector<double> b;
  double bits = 32;      ///< of the map that needs most; 32: floats
  double added_l2 = 0;   ///< growth of the relative L2 error by rounding to these bits,
                         ///< as a fraction, on the sampled slices
  double added_log = 0;  ///< the same of the log error
  double relative_l2 = 0;     ///< √(Σ e² / Σ R²)
  double rmse_over_mean = 0;  ///< RMSE in R_d over the mean R_d
  double log_rms = 0;         ///< rms of ln(model / measured) above 1e-5 of the peak
  double psnr_db = 0;         ///< 20 log10(peak / RMSE)
  double peak = 0;            ///< largest measurement, mm⁻²
  std::int64_t measured_slices = 0;  ///< that errors are of: all, or a sample
  /// Slices that were factored: all, or, where many are equal, one of each (SVDs).
  std::int64_t factored_slices = 0;
  double worst_slice = 0;  ///< largest relative L2 error of these
  int worst_slice_i = 0;
  int worst_slice_j = 0;
  double worst_total =
      0;  ///< largest |Σ model / Σ measured − 1| of a slice and channel
  double missing_fraction = 0;    ///< of all cells: invalid, filled by the model
  std::int64_t unfit_slices = 0;  ///< model or measured total not positive: not scaled
  std::vector<TermsError> error_curve;
  int passes = 0;                  ///< times that all slices were read
  int rounds = 0;                  ///< of fits that alternate, all matrices and tries
  int search_steps = 0;            ///< pairs (A, B) tried, all channels
  std::int64_t working_bytes = 0;  ///< estimated, beside dataset and material
  double cpu_seconds = 0;          ///< of the whole process while factoring
  double seconds = 0;
  Invariants invariants;           ///< of the material, checked at the end
  std::vector<std::string> notes;  ///< what a person should know

  std::string Brief() const;  ///< one line
  Json ToJson() const;
};

struct Factorization {
  Material material;
  FactorSummary summary;
};

/// Factors a dataset, in memory or streamed from its file. The SVDs read it four times
/// (scan, sums, projection, errors), large data once (`check_slices`), once more to
/// cluster, `fill_rounds` times more if values are missing; bilinear reads it three
/// times and holds all pairs of points, 5 bytes each, for which `memory_mb` must do (a
/// usage Error says how much is needed). What each holds and `bytes` and
/// `error` add: README.md. The same data, options and seed give the same bits whatever
/// the thread count.
///
/// Throws a usage Error for an unknown method or an option out of range; BadData naming
/// slice, channel and cell for a value that isn't finite, of the data or of the model;
/// Interrupted.
Factorization Factor(const reconstruct::RdDataset& dataset,
                     const FactorOptions& options,
                     const ProgressFunction& progress = {});
Factorization Factor(reconstruct::RdReader& reader,
                     const FactorOptions& options,
                     const ProgressFunction& progress = {});

/// The same beginning with `made`, a material of the same data by the same method. Of
/// the SVDs, options being what they were but for `terms` (no more), `bytes`, `error`,
/// `bits` and what errors are measured on, its leading terms are taken and nothing is
/// fitted: slices are read once, or, where all were measured and 8192 slices are
/// there, `check_slices` of them. Else clusters are kept where their number and seed
/// are, A and B where what they are chosen by is; nmf begins with its kernels where
/// there are as many terms, bilinear and reciprocal with its maps where there are no
/// more. A note says what was taken. Where `made` holds rounded values, these are what
/// is taken.
///
/// Throws, beside the above, a usage Error for another method or one that nothing can
/// be kept of (tucker, profiles, auto), BadData if `made` isn't of these data by its
/// size, provenance or error.
Factorization FactorAgain(const Material& made,
                          const reconstruct::RdDataset& dataset,
                          const FactorOptions& options,
                          const ProgressFunction& progress = {});
Factorization FactorAgain(const Material& made,
                          reconstruct::RdReader& reader,
                          const FactorOptions& options,
                          const ProgressFunction& progress = {});

/// Those that a material was made with, by its provenance, but for `bytes` and `error`;
/// what that doesn't tell is as it is by default.
FactorOptions OptionsOf(const Material& made);

}  // namespace nacre::factor
