#pragma once

#include "factor/internal/method.h"
#include "factor/internal/shared_maps.h"

#include <cstddef>
#include <memory>
#include <vector>

namespace nacre::factor::internal {

/// One pair's measurements, in peaks of the channel, and what is known of them: the
/// variance of their mean, and, once weights are set, its inverse with the model's
/// share in it. Not positive before, or 0 after: not measured.
struct Pairs {
  std::vector<float> value;
  std::vector<float> weight;
};

/// A dataset as pairs of points: what stands in the windows of both is one number,
/// their mean, for half of all offsets d: those of cells up to the middle one. Planes
/// over the first point of a pair reach beyond the grid by the window's radius, so
/// that pairs that leave the grid are there too.
///
/// Of some offsets, the near ones above all, every pair is held; of the others, where
/// memory doesn't suffice for them, only the sample that kernels are fitted to.
struct ReciprocalData {
  int width = 0;
  int height = 0;
  int margin = 0;
  int core = 0;
  std::size_t channels = 0;
  std::size_t cells = 0;           ///< (core² + 1) / 2
  std::vector<double> scale;       ///< a channel: its peak, mm⁻²
  std::vector<double> mean;        ///< [channel][cell], in peaks
  std::vector<double> noise;       ///< [channel][cell]: rms of sigma, in peaks
  std::vector<int> held;           ///< cells
  std::vector<float> share;        ///< [held]: offsets that it stands for
  Pairs pairs;                     ///< [channel][held][y][x]
  std::size_t stride = 1;          ///< the sample is pairs n · stride + cell % stride
  std::size_t sample_size = 0;     ///< of a channel and cell
  Pairs sample;                    ///< [channel][cell][n]; empty if all are held
  double tail_weight = 1;          ///< q of Tolerance
  SharedMaps sides;                ///< q of FitSides, or empty
  std::vector<double> sides_near;  ///< g: a channel's NearCells, one after the other
  bool has_weights = false;        ///< what `weight` of pairs is

  std::size_t Plane() const {
    return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  }
  bool HoldsAll() const { return held.size() == cells; }
  std::size_t HeldOffset(std::size_t channel, std::size_t n) const {
    return (channel * held.size() + n) * Plane();
  }
  std::size_t SampleOffset(std::size_t channel, std::size_t cell) const {
    return (channel * cells + cell) * sample_size;
  }
  int OffsetX(std::size_t cell) const {
    return static_cast<int>(cell) % core - (core - 1) / 2;
  }
  int OffsetY(std::size_t cell) const {
    return static_cast<int>(cell) / core - (core - 1) / 2;
  }
};

/// Where x + d lies within the planes.
struct PlaneArea {
  int x0 = 0;
  int x1 = 0;
  int y0 = 0;
  int y1 = 0;
};
PlaneArea AreaOf(const ReciprocalData& data, std::size_t cell);

/// What a model that isn't exact may be off by, squared, at R_d = `value` peaks: 1 % of
/// the peak at the peak, and less elsewhere by the power `q`: 0 counts the error in R_d
/// alone, 1 weighs like photon noise, 2 would count the relative error.
double Tolerance(double value, double q);

/// The weight of a pair with this variance (0 if it is below 0: not measured) where the
/// model says `modelled` peaks.
inline float WeightOf(float variance, double modelled, double q) {
  return variance < 0 ? 0.0F
                      : static_cast<float>(1 / (static_cast<double>(variance) +
                                                Tolerance(modelled, q)));
}

/// What ReadReciprocal needs to know beside the data.
struct ReciprocalLimits {
  int terms = 10;           ///< most that will be fitted
  int sample_pairs = 3000;  ///< wanted of an offset
  double memory_bytes = 1e9;
  double tail_weight = 1;
  bool sides = false;  ///< whether to look for them
  bool rest = false;   ///< the same
};

ReciprocalLimits LimitsOf(const FactorOptions& options);

/// Bytes that the pairs will take.
double ReciprocalBytes(const reconstruct::RdHeader& header,
                       const ReciprocalLimits& limits);

/// Reads a dataset as pairs, in one pass. Where the job has slices that stand for all,
/// `start` comes of the same pass, and so do the job's totals, unless something wasn't
/// measured. `start` may stay empty where the job's material has all maps.
ReciprocalData ReadReciprocal(Job& job,
                              const ReciprocalLimits& limits,
                              SharedMaps& start);

/// Maps to begin with: coordinates of the slices' logarithms, all channels in a row, in
/// the leading singular vectors of the sample's.
class StartingMaps {
 public:
  /// From `data.mean` and `data.noise`. Fewer than `terms` maps if there are no more to
  /// rounding.
  StartingMaps(const Job& job, const ReciprocalData& data, int terms);
  ~StartingMaps();
  /// The slices' coordinates.
  void Add(const SliceBlock& block);
  /// Gives them, what lies beyond the grid as its nearest point.
  SharedMaps Finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace nacre::factor::internal
