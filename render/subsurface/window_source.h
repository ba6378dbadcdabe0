#pragma once

#include "factor/material.h"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace nacre::render {

/// R'_d(x_i, d) on a grid, wherever it comes from. Indices, units and orientation are
/// those of reconstruct::RdHeader. Safe to ask from many threads.
class WindowSource {
 public:
  virtual ~WindowSource() = default;

  int points_x = 0;
  int points_y = 0;
  int core = 0;
  double pitch_mm = 0;
  double eta = 1;
  std::vector<std::string> channels;

  /// The window of grid point (i, j), core × core values in mm⁻², into `window`.
  virtual void EvaluateWindow(int channel, int i, int j, float* window) const = 0;
  /// One cell of it.
  virtual float Evaluate(int channel, int i, int j, int u, int v) const = 0;
  /// Σ_d R_d · pitch² of a grid point.
  virtual float Albedo(int channel, int i, int j) const = 0;

  /// Tiles read from file so far, and how many there are; 0 for what is in memory.
  virtual std::int64_t tiles_read() const { return 0; }
  virtual std::int64_t tiles_total() const { return 0; }
  /// Channels read so far; the terms of a factorization that count in them, and all.
  virtual int channels_read() const { return static_cast<int>(channels.size()); }
  virtual int terms_used() const { return 0; }
  virtual int terms_total() const { return 0; }
};

/// A factored material.
std::shared_ptr<const WindowSource> MakeMaterialSource(
    std::shared_ptr<const factor::Material> material);

/// A factored material of which channels are read when they are first asked for. Last
/// terms of a sum (of SVDs and NMFs) that change R_d by less than `error` of the
/// channel's largest value are left out, by the product of their largest values. Throws
/// BadData, also when asked.
std::shared_ptr<const WindowSource> OpenMaterialSource(
    const std::filesystem::path& path, double error = 0);

/// A dataset as it was measured, `*.rd.exr`. A slice is read when it is first asked
/// for, and kept. Throws BadData for a file that can't be read, also when asked.
std::shared_ptr<const WindowSource> OpenDatasetSource(
    const std::filesystem::path& path);

}  // namespace nacre::render
