#pragma once

#include "core/progress.h"
#include "factor/internal/mean_slice.h"
#include "factor/internal/row_basis.h"
#include "factor/internal/row_scans.h"
#include "factor/internal/row_transform.h"
#include "factor/material.h"

#include <cstdint>
#include <span>
#include <vector>

namespace nacre::factor::internal {

struct Sample;

/// What FitSvd needs to know beside the data.
struct SvdFitOptions {
  int terms = 10;
  int cluster_count = 1;
  int fill_rounds = 2;  ///< times that missing values are predicted and fitted again
  bool one_by_one = false;  ///< each term from what those before leave; FitByGram
  double tolerance = 1e-5;  ///< on the excess error, where found by iteration
  std::uint64_t seed = 1;   ///< of the rows that the iteration starts on
  int thread_count = 0;
  const Ranks* ranks = nullptr;  ///< that share passes of FitByBlocks
  /// Given both, FitByBlocks starts on these rows and, taking it that nothing is
  /// missing, tells of all rows what it reads.
  const Sample* sample = nullptr;
  RowScans* rows = nullptr;
};

/// Whether FitByBlocks serves a matrix of these sizes.
bool BlocksPay(const reconstruct::RdHeader& header, int terms);

/// The thesis' model before it becomes a Material: a transform a channel and a basis of
/// rows a channel and cluster.
struct SvdModel {
  std::vector<RowTransform> transforms;  ///< [channel]
  std::vector<RowBasis> bases;           ///< [channel][cluster]
  std::vector<ChannelScan> scans;        ///< [channel]
  std::vector<std::uint8_t> cluster;     ///< [point]
  int cluster_count = 1;
  /// [channel][point][rank]: the rows' coordinates, where the fit leaves them; else
  /// empty, and they take a projection.
  std::vector<std::vector<float>> scores;
  int passes = 0;  ///< times that all slices were read
  double excess =
      0;  ///< estimated, over the error of the exact truncated SVD, relative

  const RowBasis& Basis(std::size_t channel, std::int64_t point) const {
    return bases[channel * static_cast<std::size_t>(cluster_count) +
                 cluster[static_cast<std::size_t>(point)]];
  }
};

/// Truncated SVD of every channel's (and cluster's) matrix of transformed rows. Large
/// matrices without clusters take FitByBlocks, others FitByGram.
///
/// `model` comes with everything but `bases`, `scores`, `passes` and `excess`.
void FitSvd(SliceSource& source,
            const SvdFitOptions& options,
            SvdModel& model,
            const ProgressFunction& progress);

/// By the eigenvectors of YᵀY, core² × core², which is all that is kept of one pass
/// over the slices: 8 core⁴ bytes a channel and cluster. `fill_rounds` passes more if
/// values are missing.
void FitByGram(SliceSource& source,
               const SvdFitOptions& options,
               SvdModel& model,
               const ProgressFunction& progress);

/// By block iteration (block_svd.h), on a sample of slices first and then on all: as
/// many passes as `tolerance` and, if values are missing, `fill_rounds` take. Without
/// clusters only.
void FitByBlocks(SliceSource& source,
                 const SvdFitOptions& options,
                 SvdModel& model,
                 const ProgressFunction& progress);

/// The transformed row, missing values filled: from the mean slice, or, where the model
/// has bases, by its own prediction. Returns the number of missing values.
int CompleteRow(const SvdModel& model,
                const SliceBlock& block,
                std::int64_t row,
                std::size_t channel,
                std::span<double> values);

/// The transformed row, missing values filled from the mean slice. Returns their
/// number.
int TransformRow(std::span<const float> rd,
                 std::span<const std::uint8_t> valid,
                 const ChannelScan& scan,
                 const RowTransform& transform,
                 std::span<double> row);

/// The coordinates of a row in `basis`, from its valid cells if some are missing.
Eigen::VectorXd RowCoordinates(const RowBasis& basis,
                               std::span<const double> row,
                               std::span<const std::uint8_t> valid,
                               int missing);

/// Kernels and transform attributes as a Material keeps them; its f is sized and zero.
/// f_j gets a root mean square of 1 over the rows, h_j takes
/// the singular value; the linear model's scale and fall-off go into h too.
Material ToMaterial(const SvdModel& model,
                    const reconstruct::RdHeader& header,
                    int terms);

/// Projects one slice of one channel: stores its f.
void ProjectSlice(const SvdModel& model,
                  const SliceBlock& block,
                  std::int64_t row,
                  std::size_t channel,
                  Material& material);

}  // namespace nacre::factor::internal
