#include "reconstruct/internal/cell_weights.h"

#include "core/parallel.h"
#include "reconstruct/internal/weight_box.h"

#include <algorithm>

namespace nacre::reconstruct::internal {
namespace {

// Pixel edges are drawn straight in the sample plane; what distortion bends them by is
// far below this share of a cell.
constexpr double kFullCover = 0.999;

// Cells are cut a few rows at a time, so that the pieces of a large picture needn't all
// be there.
constexpr int kRowsABand = 8;

std::int64_t BinCount(const calibrate::CameraGeometry& camera) {
  return std::ssize(BinnedPicture(camera.width_px, camera.height_px).values);
}

}  // namespace

class CellWeights::BoxBuilder {
 public:
  BoxBuilder(const CellLattice& lattice,
             const PixelCutter& cutter,
             const calibrate::CameraGeometry& camera,
             const calibrate::SpotProfile& spot,
             const PixelModel& model)
      : pixels(std::int64_t{camera.width_px} * camera.height_px),
        bins(BinCount(camera)),
        lattice_(lattice),
        cutter_(cutter),
        camera_(camera),
        model_(model),
        sharpener_(spot, camera) {}

  // Of all cells in the band, in their order.
  void Add(RowBand band) {
    const std::vector<PixelPiece> all = cutter_.Cut(band);
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

  PixelBoxes pixels;
  PixelBoxes bins;

 private:
  void AddCell(std::span<const PixelPiece* const> pieces) {
    pixels.Begin();
    bins.Begin();
    double covered = 0;
    for (const PixelPiece* piece : pieces) {
      covered += piece->share;
    }
    if (covered < kFullCover) {
      return;
    }
    WeightBox box(pieces.data(), pieces.size());
    box.Sharpen(sharpener_);
    const int bins_wide = BinnedPicture(camera_.width_px, 1).width;
    std::vector<float> binned;
    int bin_row = -1;
    int bin_left = 0;
    const auto flush = [&] {
      if (bin_row >= 0) {
        bins.AddRow(std::int64_t{bin_row} * bins_wide + bin_left, binned);
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
      pixels.AddRow(place, weights);
      if (!model_.with_bins) {
        return;
      }
      if (row / BinnedPicture::kSide != bin_row) {
        flush();
        bin_row = row / BinnedPicture::kSide;
        bin_left = left / BinnedPicture::kSide;
        const int right = left + static_cast<int>(weights.size()) - 1;
        binned.assign(static_cast<std::size_t>(
                          std::int64_t{right / BinnedPicture::kSide} - bin_left + 1),
                      0.0F);
      }
      for (std::size_t x = 0; x < weights.size(); ++x) {
        const int bin = (left + static_cast<int>(x)) / BinnedPicture::kSide - bin_left;
        binned[static_cast<std::size_t>(bin)] += weights[x];
      }
    });
    flush();
  }

  const CellLattice& lattice_;
  const PixelCutter& cutter_;
  const calibrate::CameraGeometry& camera_;
  const PixelModel& model_;
  Sharpener sharpener_;
};

CellWeights::CellWeights(const CellLattice& lattice,
                         const calibrate::CameraGeometry& camera,
                         const calibrate::SpotProfile& spot,
                         int thread_count,
                         const PixelModel& model)
    : lattice_(lattice),
      pixels_(std::int64_t{camera.width_px} * camera.height_px),
      bins_(BinCount(camera)) {
  const PixelCutter cutter(lattice_, camera, model.place);
  const int bands = (lattice.rows + kRowsABand - 1) / kRowsABand;
  const int at_once = ThreadCount(thread_count);
  for (int first = 0; first < bands; first += at_once) {
    const int count = std::min(at_once, bands - first);
    std::vector<BoxBuilder> builders(static_cast<std::size_t>(count),
                                     BoxBuilder(lattice_, cutter, camera, spot, model));
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
  pixels_.ShrinkToFit();
  bins_.ShrinkToFit();
}

void CellWeights::Means(const RateFrame& frame,
                        std::int64_t first,
                        std::span<float> means,
                        std::span<float> variances) const {
  for (std::size_t k = 0; k < means.size(); ++k) {
    const PixelBoxes::Value sum =
        pixels_.Sum(static_cast<std::size_t>(first) + k, frame);
    means[k] = sum.mean;
    variances[k] = sum.variance;
  }
}

void CellWeights::MeansOfBins(const BinnedPicture& picture,
                              std::span<float> means) const {
  for (std::size_t k = 0; k < means.size(); ++k) {
    means[k] = bins_.Sum(k, picture.values);
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
