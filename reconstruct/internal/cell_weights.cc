#include "reconstruct/internal/cell_weights.h"

#include "core/parallel.h"
#include "reconstruct/internal/lanes.h"
#include "reconstruct/internal/weight_box.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace nacre::reconstruct::internal {
namespace {

// Pixel edges are drawn straight in the sample plane; what distortion bends them by is
// far below this share of a cell.
constexpr double kFullCover = 0.999;

// Cells are cut a few rows at a time, so that the pieces of a large picture needn't all
// be there.
constexpr int kRowsABand = 4;

}  // namespace

// A row of weights, somewhere in a picture.
struct CellWeights::Row {
  std::int64_t place;  // of its first pixel
  std::span<const float> weights;
};

class CellWeights::BoxBuilder {
 public:
  BoxBuilder(const CellLattice& lattice,
             const calibrate::CameraGeometry& camera,
             const calibrate::SpotProfile& spot,
             const PixelModel& model)
      : lattice_(lattice), camera_(camera), model_(model), sharpener_(spot, camera) {}

  // Of all cells in the band, in their order.
  void Add(RowBand band) {
    const std::vector<PixelPiece> all =
        CutPixels(lattice_, camera_, model_.place, band);
    const std::int64_t begin = lattice_.Index(0, band.begin);
    const auto cells = static_cast<std::size_t>(lattice_.Index(0, band.end) - begin);
    // Pieces by cell (counting sort: within a cell they keep the order of the pixels).
    std::vector<std::size_t> first(cells + 1, 0);
    for (const PixelPiece& piece : all) {
      ++first[static_cast<std::size_t>(piece.cell - begin) + 1];
    }
    for (std::size_t cell = 0; cell < cells; ++cell) {
      first[cell + 1] += first[cell];
    }
    std::vector<const PixelPiece*> pieces(all.size());
    std::vector<std::size_t> next(first.begin(), first.end() - 1);
    for (const PixelPiece& piece : all) {
      pieces[next[static_cast<std::size_t>(piece.cell - begin)]++] = &piece;
    }
    for (std::size_t cell = 0; cell < cells; ++cell) {
      AddCell(std::span(pieces).subspan(first[cell], first[cell + 1] - first[cell]));
    }
  }

  Boxes pixels;
  Boxes bins;

 private:
  void AddCell(std::span<const PixelPiece* const> pieces) {
    pixels.boxes.emplace_back();
    bins.boxes.emplace_back();
    double covered = 0;
    for (const PixelPiece* piece : pieces) {
      covered += piece->share;
    }
    if (covered < kFullCover) {
      return;
    }
    WeightBox box(pieces.data(), pieces.size());
    box.Sharpen(sharpener_);
    const std::int64_t count = std::int64_t{camera_.width_px} * camera_.height_px;
    const int bins_wide = BinnedPicture(camera_.width_px, 1).width;
    const int bins_high = BinnedPicture(1, camera_.height_px).height;
    std::vector<float> binned;
    int bin_row = -1;
    int bin_left = 0;
    const auto flush = [&] {
      if (bin_row >= 0) {
        Append(bins,
               std::int64_t{bins_wide} * bins_high,
               {std::int64_t{bin_row} * bins_wide + bin_left, binned});
      }
    };
    box.ForEachRow(camera_, [&](int row, int left, std::vector<float>& weights) {
      const std::int64_t place = std::int64_t{row} * camera_.width_px + left;
      for (std::size_t x = 0; x < weights.size(); ++x) {
        weights[x] /= static_cast<float>(covered);
        weights[x] *= model_.factor.empty()
                          ? 1.0F
                          : model_.factor[static_cast<std::size_t>(place) + x];
      }
      Append(pixels, count, {place, weights});
      if (!model_.with_bins) {
        return;
      }
      if (row / BinnedPicture::kSide != bin_row) {
        flush();
        bin_row = row / BinnedPicture::kSide;
        bin_left = left / BinnedPicture::kSide;
        const int right = left + static_cast<int>(weights.size()) - 1;
        binned.assign(
            static_cast<std::size_t>(right / BinnedPicture::kSide - bin_left + 1),
            0.0F);
      }
      for (std::size_t x = 0; x < weights.size(); ++x) {
        const int bin = (left + static_cast<int>(x)) / BinnedPicture::kSide - bin_left;
        binned[static_cast<std::size_t>(bin)] += weights[x];
      }
    });
    flush();
  }

  // Rows begin where a whole number of vectors still lies in the picture.
  static void Append(Boxes& boxes, std::int64_t pixel_count, const Row& row) {
    Box& own = boxes.boxes.back();
    if (own.row_count == 0) {
      own.first_row = boxes.rows.size();
      own.first_weight = boxes.weights.size();
      own.row_width =
          (static_cast<int>(row.weights.size()) + kLanes - 1) / kLanes * kLanes;
    }
    const std::int64_t start =
        std::max<std::int64_t>(0, std::min(row.place, pixel_count - own.row_width));
    boxes.rows.push_back(static_cast<std::uint32_t>(start));
    ++own.row_count;
    const std::size_t at = boxes.weights.size();
    boxes.weights.resize(at + static_cast<std::size_t>(own.row_width), 0.0F);
    std::copy(
        row.weights.begin(),
        row.weights.end(),
        boxes.weights.begin() + static_cast<std::ptrdiff_t>(
                                    at + static_cast<std::size_t>(row.place - start)));
  }

  const CellLattice& lattice_;
  const calibrate::CameraGeometry& camera_;
  const PixelModel& model_;
  Sharpener sharpener_;
};

void CellWeights::Boxes::Append(const Boxes& others) {
  for (Box box : others.boxes) {
    box.first_row += rows.size();
    box.first_weight += weights.size();
    boxes.push_back(box);
  }
  rows.insert(rows.end(), others.rows.begin(), others.rows.end());
  weights.insert(weights.end(), others.weights.begin(), others.weights.end());
}

CellWeights::CellWeights(const CellLattice& lattice,
                         const calibrate::CameraGeometry& camera,
                         const calibrate::SpotProfile& spot,
                         int thread_count,
                         const PixelModel& model)
    : lattice_(lattice) {
  const int bands = (lattice.rows + kRowsABand - 1) / kRowsABand;
  const int at_once = ThreadCount(thread_count);
  for (int first = 0; first < bands; first += at_once) {
    const int count = std::min(at_once, bands - first);
    std::vector<BoxBuilder> builders(static_cast<std::size_t>(count),
                                     BoxBuilder(lattice_, camera, spot, model));
    ParallelFor(count, thread_count, [&](std::int64_t n) {
      const int begin = (first + static_cast<int>(n)) * kRowsABand;
      builders[static_cast<std::size_t>(n)].Add(
          {begin, std::min(begin + kRowsABand, lattice.rows)});
    });
    for (const BoxBuilder& builder : builders) {
      pixels_.Append(builder.pixels);
      bins_.Append(builder.bins);
    }
  }
  pixels_.weights.shrink_to_fit();
  bins_.weights.shrink_to_fit();
}

namespace {

__attribute__((target_clones("avx512f", "avx2", "default"))) void SumBox(
    const std::uint32_t* __restrict rows,
    const float* __restrict weights,
    std::pair<int, int> count_width,
    const RateFrame& frame,
    float* __restrict results) {
  Lanes mean_sum = {};
  Lanes variance_sum = {};
  Lanes least_share = {};  // below 0: a pixel isn't usable
  const auto [count, width] = count_width;
  for (int row = 0; row < count; ++row) {
    const float* rate_row = frame.rate.data() + rows[row];
    const float* variance_row = frame.variance.data() + rows[row];
    for (int x = 0; x < width; x += kLanes, weights += kLanes) {
      Lanes weight;
      Lanes rate;
      Lanes variance;
      std::memcpy(&weight, weights, sizeof weight);
      std::memcpy(&rate, rate_row + x, sizeof rate);
      std::memcpy(&variance, variance_row + x, sizeof variance);
      const Lanes share = weight * weight * variance;
      mean_sum += weight * rate;
      variance_sum += share;
      least_share = share < least_share ? share : least_share;
    }
  }
  float mean = 0;
  float variance = 0;
  float least = 0;
  for (int lane = 0; lane < kLanes; ++lane) {
    mean += mean_sum[lane];
    variance += variance_sum[lane];
    least = std::min(least, least_share[lane]);
  }
  results[0] = least < 0 ? 0.0F : mean;
  results[1] = least < 0 ? -1.0F : variance;
}

__attribute__((target_clones("avx512f", "avx2", "default"))) float SumBins(
    const std::uint32_t* __restrict rows,
    const float* __restrict weights,
    std::pair<int, int> count_width,
    const float* __restrict values) {
  Lanes sums = {};
  const auto [count, width] = count_width;
  for (int row = 0; row < count; ++row) {
    for (int x = 0; x < width; x += kLanes, weights += kLanes) {
      Lanes weight;
      Lanes value;
      std::memcpy(&weight, weights, sizeof weight);
      std::memcpy(&value, values + rows[row] + x, sizeof value);
      sums += weight * value;
    }
  }
  float sum = 0;
  for (int lane = 0; lane < kLanes; ++lane) {
    sum += sums[lane];
  }
  return sum;
}

}  // namespace

void CellWeights::Means(const RateFrame& frame,
                        std::int64_t first,
                        std::span<float> means,
                        std::span<float> variances) const {
  for (std::size_t k = 0; k < means.size(); ++k) {
    const Box& box = pixels_.boxes[static_cast<std::size_t>(first) + k];
    float results[2] = {0.0F, -1.0F};
    if (box.row_count > 0) {
      SumBox(&pixels_.rows[box.first_row],
             &pixels_.weights[box.first_weight],
             {box.row_count, box.row_width},
             frame,
             results);
    }
    means[k] = results[0];
    variances[k] = results[1];
  }
}

void CellWeights::MeansOfBins(const BinnedPicture& picture,
                              std::span<float> means) const {
  for (std::size_t k = 0; k < means.size(); ++k) {
    const Box& box = bins_.boxes[k];
    means[k] = box.row_count == 0 ? 0.0F
                                  : SumBins(&bins_.rows[box.first_row],
                                            &bins_.weights[box.first_weight],
                                            {box.row_count, box.row_width},
                                            picture.values.data());
  }
}

CellWeights::Value CellWeights::Mean(const RateFrame& frame, std::int64_t cell) const {
  float mean = 0;
  float variance = 0;
  Means(frame, cell, {&mean, 1}, {&variance, 1});
  return {static_cast<double>(mean),
          static_cast<double>(std::max(0.0F, variance)),
          variance >= 0};
}

}  // namespace nacre::reconstruct::internal
