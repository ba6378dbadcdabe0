#pragma once

#include "core/progress.h"
#include "factor/material.h"
#include "reconstruct/rd_dataset.h"

#include <filesystem>
#include <memory>
#include <vector>

namespace nacre::cli::view {

/// A dataset or a material, slice by slice. Safe from several threads.
class Sample {
 public:
  virtual ~Sample() = default;
  const reconstruct::RdHeader& header() const { return header_; }
  /// [channel][point]: Σ_d R_d · pitch².
  const std::vector<std::vector<float>>& albedo() const { return albedo_; }
  float LargestAlbedo() const;
  /// `terms` of a material's sum, 0 for all; a dataset has no terms.
  virtual reconstruct::RdSlice Slice(int i, int j, int terms) const = 0;
  /// Null for a dataset.
  virtual const factor::Material* material() const { return nullptr; }

 protected:
  reconstruct::RdHeader header_;
  std::vector<std::vector<float>> albedo_;
};

/// `*.rd.exr`, read once for its albedo, then slice by slice; `*.nacre.exr`. Throws
/// what their readers throw.
std::unique_ptr<Sample> OpenSample(const std::filesystem::path& path,
                                   const ProgressFunction& progress);

/// The exitance at all grid points, [channel][point], when the disc of `radius_mm`
/// around (x, y) mm is lit evenly with irradiance 1: Σ R_d(x_i, x_o − x_i) pitch² over
/// the disc's points x_i, those on its rim by the share of their cell.
std::vector<std::vector<float>> LightDisc(const Sample& sample,
                                          double x_mm,
                                          double y_mm,
                                          double radius_mm);

}  // namespace nacre::cli::view
