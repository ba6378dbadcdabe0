#pragma once

#include "acquire/schedule.h"
#include "reconstruct/internal/group_reader.h"
#include "reconstruct/internal/group_spool.h"
#include "reconstruct/internal/tails.h"
#include "reconstruct/rd_dataset.h"
#include "reconstruct/reconstruct.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace nacre::reconstruct::internal {

/// Slices from the pictures of groups. A cell of a picture holds the light of all its
/// spots, M = Σ_j R_j + noise. Each R_j has a prior: beyond the inner part of a window
/// the tail fitted to its own slice and to the slice at the cell (TailMap), known to a
/// share that is measured too; in the inner part nothing is known. What is most likely
/// then,
///   R_k = T_k + V_k (M − Σ_j T_j) / (Σ_j V_j + σ²),  V_j = (s T_j)²,
/// is the solution of the linear least squares problem of that cell. Tails are fitted
/// to the slices that come out, and so on for a few rounds, first with the windows'
/// inner parts alone; how tails go on beyond a window is seen where pictures are
/// outside all windows.
class Separation {
 public:
  /// All but options must outlive this; `spool` holds the groups that were captured.
  Separation(const RdHeader& header,
             const acquire::Schedule& schedule,
             const GroupReader& reader,
             const GroupSpool& spool,
             const ReconstructOptions& options);

  /// Fits the tails; collective with the options' ranks, which share slices. Without it
  /// slices are what their pictures show, everything that other spots lit included.
  void FitTails();

  struct Value {
    float rd = 0;
    double variance = -1;  ///< below 0: not measured
    float foreign = 0;     ///< of other spots, taken away
  };
  /// R_d(x_i, x_i + d) of slice s and window cell (u, v).
  Value At(std::int64_t s, int channel, int u, int v) const;

  /// All of slice s; `share` is set to the largest share of a channel's total that was
  /// taken away.
  RdSlice Slice(std::int64_t s, double* share = nullptr) const;

  /// What glare leaves uncertain of slice s, a standard deviation a value (in
  /// glare_floor.cc).
  std::vector<float> Floor(std::int64_t s) const;

  /// Whether windows overlap, so that separating is not a small correction.
  bool IsDense() const { return is_dense_; }
  /// How far tails are off, relative, a channel.
  float Spread(int channel) const {
    return spread_[static_cast<std::size_t>(channel)].front();
  }

 private:
  // A cell of a picture outside all its windows.
  struct Outside {
    int group;
    int channel;
    int column;
    int row;
    float rd;
    float sigma;
  };

  // The light of a picture's other spots in a window cell. Squares are doubles: those
  // of what is below 1e-19 or above 1e19 mm⁻² are no floats.
  struct Foreign {
    float light = 0;
    double variance = 0;
    double square = 0;   // Σ light² of the spots
    bool hides = false;  // the cell is in another spot's inner part
  };
  // The other spots of a slice's picture. What those nearby shine into a window is
  // steep; of those farther away it is smooth, and bilinear between every fourth cell.
  struct Others {
    std::vector<acquire::GridIndex> near;
    std::vector<acquire::GridIndex> far;
  };
  Others OthersOf(std::int64_t s) const;
  using Spots = std::span<const acquire::GridIndex>;
  Foreign ForeignAt(Spots others, std::int64_t s, int channel, int u, int v) const;
  static Foreign Sum(const Foreign& a, const Foreign& b);
  struct Node;
  Node NodeOf(int u) const;
  static Foreign Mix(const Foreign& a, const Foreign& b, float second);
  Value ValueOf(std::int64_t s, int channel, int u, int v, const Foreign& other) const;
  std::vector<Outside> SampleOutside() const;
  void FitSlices(double outer);
  void FitFalloff(const std::vector<Outside>& outside);
  void MeasureSpread();
  float SpreadAt(int channel, int du, int dv) const;
  float EnterFactor(std::int64_t s, int channel) const {
    return enter_factor_[static_cast<std::size_t>(s * channels_ + channel)];
  }

  const RdHeader& header_;
  const acquire::Schedule& schedule_;
  const GroupSpool& spool_;
  CellLattice lattice_;
  int channels_;
  int thread_count_;
  const Ranks* ranks_;
  bool is_dense_;
  double spacing_;                   // of spots, in half widths of a window
  std::vector<int> group_of_;        // by slice
  std::vector<bool> lit_;            // by slice
  std::vector<float> enter_factor_;  // [slice][channel]
  bool has_tails_ = false;
  TailMap tails_;
  // Of tails, relative, in rings from the inner part outwards.
  static constexpr int kSpreadRings = 5;
  static constexpr float kFirstSpread = 0.2F;
  using Spreads = std::array<float, kSpreadRings>;
  // Of a window's half width: nearer to its spot tails aren't a prior.
  static constexpr double kInner = 0.55;
  int RingOf(double cells) const;
  std::vector<Spreads> spread_;
};

}  // namespace nacre::reconstruct::internal
