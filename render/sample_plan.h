#pragma once

#include "render/accumulator.h"

#include <vector>

namespace nacre::render {

enum class Sampling {
  kEven,
  kAdaptive,      ///< more samples where they help more
  kAsGoodAsEven,  ///< the same, until the error is what even samples would have
};

struct SampleBudget {
  int spp = 64;             ///< samples a pixel: of each, or on average at most
  double error_target = 0;  ///< relative L2 error at which to stop; 0: none
  Sampling sampling = Sampling::kEven;
};

/// How many samples each tile of the picture gets, pass by pass. The picture's error is
/// E² = Σ v / n over its tiles, v the summed variance of a tile's pixels and n their
/// samples. What lowers it most for its cost is n ∝ √v, so that all tiles where samples
/// are added have the same v / n² (a pixel). Tiles of fixed numbers of samples all get
/// the same.
///
/// A pass never more than doubles a tile's samples, so that estimates of v grow with
/// what depends on them; v is averaged with the tiles around, since light that is
/// rarely found may not have been found yet.
class SamplePlan {
 public:
  static constexpr int kTile = 8;  ///< pixels along a side

  SamplePlan(const Film& film, const SampleBudget& budget);

  int tiles_x() const { return tiles_x_; }
  int tiles_y() const { return tiles_y_; }
  std::int64_t TileCount() const { return std::int64_t{tiles_x_} * tiles_y_; }
  std::int64_t PixelsOf(std::int64_t tile) const;

  /// The samples that each tile's pixels should have after the next pass, or nothing if
  /// all is done.
  std::vector<int> Next(const Accumulator& film) const;

  /// Samples of the picture: with that many in each tile's pixels, and at most.
  std::int64_t SamplesUpTo(const std::vector<int>& tiles) const;
  std::int64_t SamplesAtMost() const;

 private:
  struct Tile {
    double variance = 0;   ///< of a sample, summed over its pixels
    double deviation = 0;  ///< of a sample of one pixel
    double pixels = 0;
    int done = 0;
  };
  std::vector<Tile> Survey(const Accumulator& film) const;
  std::vector<int> Uniform(int done) const;
  std::vector<int> Adapted(const std::vector<Tile>& tiles, double level) const;
  double LevelForSamples(const std::vector<Tile>& tiles) const;
  double LevelForError(const std::vector<Tile>& tiles, double error2) const;
  double SquaredErrorAllowed(const Accumulator& film,
                             const std::vector<Tile>& tiles) const;

  Film film_;
  SampleBudget budget_;
  int tiles_x_;
  int tiles_y_;
};

}  // namespace nacre::render
