// Truncated SVDs of a dataset's channels by block iteration.

#include "factor/internal/block_svd.h"
#include "factor/internal/log_svd.h"
#include "factor/internal/method.h"
#include "factor/internal/row_kernels.h"

#include <algorithm>
#include <cstring>

namespace nacre::factor::internal {
namespace {

// The sample must be a small part for its passes to cost little.
constexpr std::int64_t kLeastRows = 2 * kSvdSampleRows;

bool HasMissing(const SvdModel& model, const reconstruct::RdHeader& header) {
  return std::any_of(
      model.scans.begin(), model.scans.end(), [&](const ChannelScan& scan) {
        return scan.used < header.PointCount() * header.WindowSize();
      });
}

RowBasis ToBasis(const BlockSvd& svd, const reconstruct::RdHeader& header) {
  RowBasis basis;
  basis.rows = header.PointCount();
  basis.vectors = svd.vectors;
  basis.sigma = svd.sigma;
  basis.mean = svd.mean;
  const auto n = static_cast<double>(basis.rows);
  basis.variance = (svd.sigma.cwiseAbs2() / n - svd.mean.cwiseAbs2()).cwiseMax(0);
  basis.residual_variance = std::max(0.0, svd.squares - svd.sigma.squaredNorm()) /
                            (n * static_cast<double>(header.WindowSize()));
  return basis;
}

// A reading of a file costs more than further columns.
constexpr int kSpareOfFiles = 20;

}  // namespace

bool BlocksPay(const reconstruct::RdHeader& header, int terms) {
  return header.PointCount() >= kLeastRows &&
         4 * PaddedColumns(terms) <= header.WindowSize();
}

void FitByBlocks(SliceSource& source,
                 const SvdFitOptions& options,
                 SvdModel& model,
                 const ProgressFunction& progress) {
  const reconstruct::RdHeader& header = source.header();
  const auto window = static_cast<std::size_t>(header.WindowSize());
  const std::size_t channel_count = model.scans.size();
  const bool has_missing = HasMissing(model, header);

  const auto fill =
      [&](const SliceBlock& block, std::int64_t row, std::size_t channel, float* y) {
        const auto offset =
            (static_cast<std::size_t>(row) * channel_count + channel) * window;
        if (options.rows != nullptr) {
          options.rows->Add(channel, block.first + row, {block.rd + offset, window});
          if (std::memchr(block.valid + offset, 0, window) != nullptr) {
            options.rows->has_missing = true;
          }
        }
        if (!has_missing || std::memchr(block.valid + offset, 0, window) == nullptr) {
          const std::vector<double>& falloff = model.scans[channel].falloff;
          if (falloff.empty()) {
            return TransformFloats(
                model.transforms[channel], {block.rd + offset, window}, y);
          }
          std::vector<float> divided(window);
          for (std::size_t cell = 0; cell < window; ++cell) {
            divided[cell] = static_cast<float>(
                static_cast<double>(block.rd[offset + cell]) / falloff[cell]);
          }
          return TransformFloats(model.transforms[channel], divided, y);
        }
        std::vector<double> values(window);
        CompleteRow(model, block, row, channel, values);
        return CopyRow(values, y);
      };
  std::vector<std::size_t> channels(channel_count);
  for (std::size_t c = 0; c < channel_count; ++c) {
    channels[c] = c;
  }
  BlockSvdSolver solver(fill,
                        channels,
                        {.terms = options.terms,
                         .tolerance = options.tolerance,
                         .least_passes = has_missing ? 1 + options.fill_rounds : 1,
                         .spare = source.in_memory() ? 4 : kSpareOfFiles,
                         .workers = {options.thread_count, options.ranks}});
  std::vector<RowBasis> bases(channel_count);
  solver.OnBasis([&](std::size_t channel, const BlockSvd& svd) {
    bases[channel] = ToBasis(svd, header);
    if (channel + 1 == channel_count) {
      model.bases = bases;
    }
  });
  Sample taken;
  if (options.sample == nullptr) {
    taken = TakeSample(source, kSvdSampleRows, options.seed);
  }
  const Sample& sample = options.sample == nullptr ? taken : *options.sample;
  BlockSvds found = solver.Solve(*SourceOf(sample.dataset), source, progress);
  model.passes += found.passes;
  if (options.rows != nullptr) {
    options.rows->Join(options.ranks);
  }
  for (BlockSvd& svd : found.svds) {
    model.excess = std::max(model.excess, svd.excess);
    if (!has_missing) {  // else they belong to the values filled before
      PassLots(header.PointCount()).Join(options.ranks, std::span<float>(svd.scores));
      model.scores.push_back(std::move(svd.scores));
    }
  }
}

void FitSvd(SliceSource& source,
            const SvdFitOptions& options,
            SvdModel& model,
            const ProgressFunction& progress) {
  if (options.cluster_count == 1 && !options.one_by_one &&
      BlocksPay(source.header(), options.terms) &&
      std::all_of(model.transforms.begin(), model.transforms.end(), FitsFloats)) {
    FitByBlocks(source, options, model, progress);
  } else {
    FitByGram(source, options, model, progress);
  }
}

}  // namespace nacre::factor::internal
